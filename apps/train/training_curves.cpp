// SPDX-License-Identifier: MIT
#include "apps/train/training_curves.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include <fmt/format.h>

#include "geometry/io/container/atomic_file.h"

namespace holdfast::apps {
namespace {

using nlohmann::json;

constexpr double kWidth = 560.0, kHeight = 240.0, kLeft = 56.0, kBottom = 28.0, kTop = 10.0;

}  // namespace

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
              double scale, std::string name, std::string colour) {
  Curve curve{std::move(name), std::move(colour), {}};
  for (const json& line : lines) {
    if (line.value("kind", "") != kind || !line.contains(at) || !line[at].is_number()) continue;
    curve.points.emplace_back(line["iteration"].get<double>(), scale * line[at].get<double>());
  }
  return curve;
}

std::string Figure(const std::string& title, const std::vector<Curve>& curves, double iterations,
                   bool logarithmic) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Curve& curve : curves) {
    for (const auto& [x, y] : curve.points) {
      if (logarithmic && y <= 0.0) continue;
      low = std::min(low, y);
      high = std::max(high, y);
    }
  }
  if (!(low <= high)) return "";
  if (!logarithmic) low = std::min(low, 0.0);
  const auto height = [&](double y) {
    const double share = logarithmic
                             ? (std::log(y) - std::log(low)) / std::max(std::log(high / low), 1e-9)
                             : (y - low) / std::max(high - low, 1e-9);
    return kHeight - kBottom - share * (kHeight - kBottom - kTop);
  };
  std::string svg =
      fmt::format("<figure><figcaption>{}</figcaption><svg viewBox='0 0 {} {}' role='img'>", title,
                  kWidth, kHeight);
  for (int k = 0; k <= 4; ++k) {
    const double share = k / 4.0;
    const double y = logarithmic ? low * std::pow(high / low, share) : low + share * (high - low);
    svg += fmt::format(
        "<line class='grid' x1='{0}' x2='{1}' y1='{2:.1f}' y2='{2:.1f}'/>"
        "<text x='{3}' y='{4:.1f}' text-anchor='end'>{5:.3g}</text>",
        kLeft, kWidth, height(y), kLeft - 6, height(y) + 4, y);
    svg += fmt::format("<text x='{:.1f}' y='{}' text-anchor='{}'>{:.0f}</text>",
                       kLeft + share * (kWidth - kLeft), kHeight - 8,
                       k == 0 ? "start" : (k == 4 ? "end" : "middle"), share * iterations);
  }
  std::string legend;
  for (const Curve& curve : curves) {
    if (curve.points.empty()) continue;
    std::string path;
    for (const auto& [x, y] : curve.points) {
      if (logarithmic && y <= 0.0) continue;
      path += fmt::format("{:.1f},{:.1f} ", kLeft + x / iterations * (kWidth - kLeft), height(y));
    }
    svg += fmt::format("<polyline points='{}' stroke='{}'/>", path, curve.colour);
    legend += fmt::format("<span style='color:{}'>{} {:.4g}</span>", curve.colour, curve.name,
                          curve.points.back().second);
  }
  return svg + "</svg><p>" + legend + "</p></figure>";
}

std::string PageOfFigures(const std::string& title, const std::vector<std::string>& figures) {
  std::string page =
      "<!doctype html><html lang='en'><meta charset='utf-8'><title>" + title +
      "</title><style>"
      "body{font:15px/1.5 system-ui,sans-serif;margin:2rem auto;max-width:1200px;padding:0 1rem;"
      "color:#1a1d21;background:#fff}main{display:flex;flex-wrap:wrap;gap:1.5rem}"
      "figure{margin:0;flex:1 1 520px;max-width:580px}figcaption{font-weight:600}svg{width:100%}"
      "svg text{font-size:11px;fill:#5b6470}.grid{stroke:#e3e6ea}"
      "polyline{fill:none;stroke-width:1.8}p span{margin-right:1.2em}"
      "@media(prefers-color-scheme:dark){body{background:#14171a;color:#e6e8ea}"
      ".grid{stroke:#2b3036}}</style><h1>" +
      title + "</h1><main>";
  for (const std::string& figure : figures) page += figure;
  return page + "</main></html>\n";
}

}  // namespace holdfast::apps
