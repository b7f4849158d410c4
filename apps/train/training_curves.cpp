// SPDX-License-Identifier: MIT
#include "apps/train/training_curves.h"

#include <cmath>
#include <sstream>

#include <fmt/format.h>

#include "apps/charts.h"
#include "apps/page.h"
#include "geometry/io/container/atomic_file.h"

namespace holdfast::apps {

using nlohmann::json;

std::vector<json> LinesBefore(const std::filesystem::path& log, long iteration) {
  std::vector<json> lines;
  std::error_code ignored;
  if (!std::filesystem::exists(log, ignored) || std::filesystem::file_size(log, ignored) == 0) {
    return lines;
  }
  std::istringstream in(ReadFile(log));
  for (std::string text; std::getline(in, text);) {
    const json line = json::parse(text, nullptr, false);
    if (line.is_object() && line.value("iteration", iteration + 1) <= iteration) {
      lines.push_back(line);
    }
  }
  return lines;
}

Curve CurveOf(const std::vector<json>& lines, const std::string& kind, const json::json_pointer& at,
              double scale, std::string name, std::string color) {
  Curve curve{std::move(name), std::move(color), {}};
  for (const json& line : lines) {
    if (line.value("kind", "") != kind || !line.contains(at) || !line[at].is_number()) continue;
    curve.points.emplace_back(line["iteration"].get<double>(), scale * line[at].get<double>());
  }
  return curve;
}

std::string Figure(const std::string& title, const std::vector<Curve>& curves, double iterations,
                   bool logarithmic) {
  constexpr double kWidth = 560.0, kHeight = 240.0, kLeft = 56.0, kBottom = 28.0, kTop = 10.0;
  const ChartAxis x{0.0, iterations, kLeft, kWidth};
  ChartAxis y{0.0, 0.0, kHeight - kBottom, kTop, logarithmic};
  ChartRange range;
  for (const Curve& curve : curves) {
    for (const auto& [iteration, value] : curve.points) {
      if (y.Has(value)) range.Include(value);
    }
  }
  if (range.Empty()) return "";
  if (!logarithmic) range.Include(0.0);
  y.low = range.low, y.high = range.high;
  std::string svg =
      "<figure><figcaption>" + EscapeHtml(title) + "</figcaption>" + SvgOpen(kWidth, kHeight);
  for (int k = 0; k <= 4; ++k) {
    const double share = k / 4.0;
    const double value =
        logarithmic ? y.low * std::pow(y.high / y.low, share) : y.low + share * (y.high - y.low);
    svg += SvgGrid(kLeft, kWidth, y.At(value), fmt::format("{:.3g}", value));
    svg += SvgText(x.At(share * iterations), kHeight - 8, fmt::format("{:.0f}", share * iterations),
                   k == 0 ? "start" : (k == 4 ? "end" : "middle"));
  }
  std::string legend;
  for (const Curve& curve : curves) {
    if (curve.points.empty()) continue;
    svg += SvgPolyline(curve.points, x, y, curve.color);
    legend += fmt::format("<span style='color:{}'>{} {:.4g}</span>", curve.color,
                          EscapeHtml(curve.name), curve.points.back().second);
  }
  return svg + "</svg><p>" + legend + "</p></figure>";
}

std::string PageOfFigures(const std::string& title, const std::vector<std::string>& figures) {
  std::string page =
      PageHead(
          title, title,
          "body{font:15px/1.5 system-ui,sans-serif;margin:2rem auto;max-width:1200px;padding:0 "
          "1rem;"
          "color:#1a1d21;background:#fff}main{display:flex;flex-wrap:wrap;gap:1.5rem}"
          "figure{margin:0;flex:1 1 520px;max-width:580px}figcaption{font-weight:600}"
          "svg{width:100%;height:auto}svg text{font-size:11px;fill:#5b6470}.grid{stroke:#e3e6ea}"
          "polyline{fill:none;stroke-width:1.8}p span{margin-right:1.2em}"
          "@media(prefers-color-scheme:dark){body{background:#14171a;color:#e6e8ea}"
          ".grid{stroke:#2b3036}}") +
      "<main>";
  for (const std::string& figure : figures) page += figure;
  return page + "</main></body></html>\n";
}

}  // namespace holdfast::apps
