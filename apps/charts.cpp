// SPDX-License-Identifier: MIT
#include "apps/charts.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "apps/page.h"

namespace holdfast::apps {
namespace {

// 1, 2 or 5 times a power of ten, so that about `parts` of them cover `range`.
double RoundStep(double range, int parts) {
  const double rough = range / parts, power = std::pow(10.0, std::floor(std::log10(rough)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (rough <= factor * power * (1.0 + 1e-9)) return factor * power;
  }
  return 10.0 * power;
}

std::string AxisNumber(double value) {
  return fmt::format("{:.4g}", std::abs(value) < 1e-12 ? 0.0 : value);  // never "-0"
}

// A legend below a chart: words wrap by themselves there.
std::string LegendBelow(const std::vector<std::pair<std::string, std::string>>& entries) {
  std::string html = "<figcaption>";
  for (const auto& [label, color] : entries) {
    html +=
        fmt::format("<span><i style=\"background:{}\"></i>{}</span> ", color, EscapeHtml(label));
  }
  return html + "</figcaption>";
}

}  // namespace

const char* const kChartStyle = R"(
figure { display: inline-block; margin: .4rem; vertical-align: top; }
figcaption { font-size: 12px; max-width: 400px; }
figcaption span { white-space: nowrap; margin-right: .8em; }
figcaption i { display: inline-block; width: 9px; height: 9px; margin-right: 4px; }
svg { font: 11px system-ui, sans-serif; fill: currentColor; max-width: 100%; }
svg .title { font-size: 13px; font-weight: 600; }
svg .axis { opacity: .75; }
svg .grid { stroke: #8884; } svg .band { fill-opacity: .13; stroke: none; }
)";

std::string Percent(double share, int digits) {
  return fmt::format("{:.{}f} %", 100.0 * share, digits);
}

std::string SvgOpen(int width, int height) {
  return fmt::format("<svg viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" role=\"img\">",
                     width, height);
}

std::string SvgText(double x, double y, const std::string& text, const char* anchor,
                    const char* style) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" {}>{}</text>", x, y,
                     anchor, style, EscapeHtml(text));
}

std::string SvgLine(const char* kind, double x1, double y1, double x2, double y2) {
  return fmt::format("<line class=\"{}\" x1=\"{:.1f}\" x2=\"{:.1f}\" y1=\"{:.1f}\" y2=\"{:.1f}\"/>",
                     kind, x1, x2, y1, y2);
}

std::string SvgGrid(double x1, double x2, double y, const std::string& label) {
  return SvgLine("grid", x1, y, x2, y) + SvgText(x1 - 5, y + 4, label, "end");
}

void ChartRange::Include(double value) {
  if (!std::isfinite(value)) return;
  low = std::min(low, value);
  high = std::max(high, value);
}

double ChartAxis::At(double value) const {
  const auto on_axis = [&](double v) { return logarithmic ? std::log(std::max(v, 1e-300)) : v; };
  const double range = std::max(on_axis(high) - on_axis(low), 1e-12);
  return begin + (end - begin) * std::clamp((on_axis(value) - on_axis(low)) / range, 0.0, 1.0);
}

bool ChartAxis::Has(double value) const {
  return std::isfinite(value) && (!logarithmic || value > 0.0);
}

std::string SvgPolyline(const std::vector<std::pair<double, double>>& points, const ChartAxis& x,
                        const ChartAxis& y, const std::string& color, const char* style,
                        const std::string& title) {
  std::string places;
  for (const auto& [at, value] : points) {
    if (y.Has(value)) places += fmt::format("{:.1f},{:.1f} ", x.At(at), y.At(value));
  }
  return fmt::format(
      "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"{}>{}</polyline>",
      places, color, style, title.empty() ? "" : "<title>" + EscapeHtml(title) + "</title>");
}

std::string DrawLineChart(const LineChart& chart) {
  constexpr double kWidth = 400, kHeight = 250, kLeft = 46, kRight = 12, kTop = 40, kBottom = 38;
  ChartAxis at_x{0.0, 1.0, kLeft, kWidth - kRight};
  ChartAxis at_y{0.0, 1.0, kHeight - kBottom, kTop, chart.logarithmic};
  ChartRange xs, ys;
  for (const ChartLine& line : chart.lines) {
    for (std::size_t i = 0; i < line.points.size(); ++i) {
      xs.Include(line.points[i].first);
      if (at_y.Has(line.points[i].second)) ys.Include(line.points[i].second);
      if (!line.high.empty() && at_y.Has(line.high[i])) ys.Include(line.high[i]);
    }
  }
  if (xs.Empty() || ys.Empty()) return "";
  if (!chart.logarithmic) ys.low = std::min(ys.low, 0.0);
  if (ys.high <= ys.low) ys.high = ys.low + 1.0;
  if (xs.high <= xs.low) xs.high = xs.low + 1.0;
  const double step = chart.logarithmic ? 1.0 : RoundStep(ys.high - ys.low, 4);
  if (chart.logarithmic) {
    ys.low = std::floor(std::log10(ys.low));
    ys.high = std::max(std::ceil(std::log10(ys.high)), ys.low + 1.0);
  } else {
    ys.high = step * std::ceil(ys.high / step - 1e-9);
  }
  const auto value = [&](double y) { return chart.logarithmic ? std::pow(10.0, y) : y; };
  at_x.low = xs.low, at_x.high = xs.high;
  at_y.low = value(ys.low), at_y.high = value(ys.high);

  std::string svg = "<figure>" + SvgOpen(kWidth, kHeight);
  svg += SvgText(4, 14, chart.title, "start", "class=\"title\"");
  svg += SvgText(4, 29, chart.y_label, "start", "class=\"axis\"");
  for (double y = ys.low; y <= ys.high + 1e-9 * step; y += step) {
    svg += SvgGrid(kLeft, kWidth - kRight, at_y.At(value(y)), AxisNumber(value(y)));
  }
  const double x_step = RoundStep(xs.high - xs.low, 5);
  for (double x = x_step * std::ceil(xs.low / x_step - 1e-9); x <= xs.high + 1e-9 * x_step;
       x += x_step) {
    svg += SvgText(at_x.At(x), kHeight - kBottom + 15, AxisNumber(x));
  }
  svg += SvgText(0.5 * (at_x.begin + at_x.end), kHeight - 6, chart.x_label, "middle",
                 "class=\"axis\"");
  std::vector<std::pair<std::string, std::string>> entries;
  for (const ChartLine& line : chart.lines) {
    entries.emplace_back(line.label, line.color);
    if (!line.low.empty()) {
      std::string there, back;
      for (std::size_t i = 0; i < line.points.size(); ++i) {
        const double x = at_x.At(line.points[i].first);
        there += fmt::format("{:.1f},{:.1f} ", x, at_y.At(line.high[i]));
        back = fmt::format("{:.1f},{:.1f} ", x, at_y.At(line.low[i])) + back;
      }
      svg += fmt::format("<polygon class=\"band\" points=\"{}{}\" fill=\"{}\"/>", there, back,
                         line.color);
    }
    svg += SvgPolyline(line.points, at_x, at_y, line.color);
  }
  return svg + "</svg>" + LegendBelow(entries) + "</figure>\n";
}

}  // namespace holdfast::apps
