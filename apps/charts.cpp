// SPDX-License-Identifier: MIT
#include "apps/charts.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace holdfast::apps {
namespace {

// 1, 2 or 5 times a power of ten, such that about `parts` steps cover `range`.
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

// A legend below a chart, in HTML, where words wrap automatically.
std::string LegendBelow(const std::vector<std::pair<std::string, std::string>>& entries) {
  std::string html = "<figcaption>";
  for (const auto& [label, color] : entries) {
    html +=
        fmt::format("<span><i style=\"background:{}\"></i>{}</span> ", color, EscapeHtml(label));
  }
  return html + "</figcaption>";
}

// SVG elements in pixels; `style` has attributes.
std::string SvgOpen(int width, int height) {
  return fmt::format("<svg viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" role=\"img\">",
                     width, height);
}

std::string SvgText(double x, double y, const std::string& text, const char* anchor = "middle",
                    const char* style = "") {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" {}>{}</text>", x, y,
                     anchor, style, EscapeHtml(text));
}

std::string SvgLine(const char* kind, double x1, double y1, double x2, double y2) {
  return fmt::format("<line class=\"{}\" x1=\"{:.1f}\" x2=\"{:.1f}\" y1=\"{:.1f}\" y2=\"{:.1f}\"/>",
                     kind, x1, x2, y1, y2);
}

// A horizontal line, with its value on the left.
std::string SvgGrid(double x1, double x2, double y, const std::string& label) {
  return SvgLine("grid", x1, y, x2, y) + SvgText(x1 - 5, y + 4, label, "end");
}

// Range of values shown by a chart.
struct ChartRange {
  double low = std::numeric_limits<double>::infinity(), high = -low;

  // Ignores non-finite values.
  void Include(double value) {
    if (!std::isfinite(value)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  bool Empty() const { return !(low <= high); }
};

// Maps values from `low` to `high` to pixels `begin` to `end`; clamps values outside.
struct ChartAxis {
  double low, high, begin, end;

  double At(double value) const {
    const double range = std::max(high - low, 1e-12);
    return begin + (end - begin) * std::clamp((value - low) / range, 0.0, 1.0);
  }
};

std::string SvgPolyline(const std::vector<std::pair<double, double>>& points, const ChartAxis& x,
                        const ChartAxis& y, const std::string& color) {
  std::string places;
  for (const auto& [at, value] : points) {
    if (std::isfinite(value)) places += fmt::format("{:.1f},{:.1f} ", x.At(at), y.At(value));
  }
  return fmt::format(
      "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"></polyline>", places,
      color);
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
svg .grid { stroke: #8884; }
)";

std::string Percent(double share, int digits) {
  return fmt::format("{:.{}f} %", 100.0 * share, digits);
}

std::string DrawLineChart(const LineChart& chart) {
  constexpr double kWidth = 400, kHeight = 250, kLeft = 46, kRight = 12, kTop = 40, kBottom = 38;
  ChartRange xs, ys;
  for (const ChartLine& line : chart.lines) {
    for (const auto& [x, y] : line.points) {
      xs.Include(x);
      ys.Include(y);
    }
  }
  if (xs.Empty() || ys.Empty()) return "";
  ys.low = std::min(ys.low, 0.0);
  if (ys.high <= ys.low) ys.high = ys.low + 1.0;
  if (xs.high <= xs.low) xs.high = xs.low + 1.0;
  const double step = RoundStep(ys.high - ys.low, 4);
  ys.high = step * std::ceil(ys.high / step - 1e-9);
  const ChartAxis at_x{xs.low, xs.high, kLeft, kWidth - kRight};
  const ChartAxis at_y{ys.low, ys.high, kHeight - kBottom, kTop};

  std::string svg = "<figure>" + SvgOpen(kWidth, kHeight);
  svg += SvgText(4, 14, chart.title, "start", "class=\"title\"");
  svg += SvgText(4, 29, chart.y_label, "start", "class=\"axis\"");
  for (double y = ys.low; y <= ys.high + 1e-9 * step; y += step) {
    svg += SvgGrid(kLeft, kWidth - kRight, at_y.At(y), AxisNumber(y));
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
    svg += SvgPolyline(line.points, at_x, at_y, line.color);
  }
  return svg + "</svg>" + LegendBelow(entries) + "</figure>\n";
}

const char* const kTableStyle = R"(
:root { color-scheme: light dark; }
body { font: 15px/1.5 system-ui, sans-serif; max-width: 84rem; margin: 2rem auto; padding: 0 1rem; }
table { border-collapse: collapse; margin: .5rem 0 1.5rem; font-variant-numeric: tabular-nums; }
.scroll { overflow-x: auto; })";

std::string PageHead(const std::string& title, const std::string& heading,
                     const std::string& style) {
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n<meta name=\"viewport\" "
      "content=\"width=device-width, initial-scale=1\">\n<title>{}</title><style>{}</style>"
      "</head><body>\n<h1>{}</h1>\n",
      EscapeHtml(title), style, EscapeHtml(heading));
}

std::string HtmlTable(const std::vector<std::string>& heads,
                      const std::vector<std::vector<std::string>>& rows) {
  std::string html = "<div class=\"scroll\"><table>";
  const auto add = [&](const std::vector<std::string>& cells, const char* cell) {
    html += "<tr>";
    for (const std::string& text : cells) {
      html += fmt::format("<{0}>{1}</{0}>", cell, EscapeHtml(text));
    }
    html += "</tr>";
  };
  if (!heads.empty()) add(heads, "th");
  html += "\n";
  for (const std::vector<std::string>& row : rows) {
    add(row, "td");
    html += "\n";
  }
  return html + "</table></div>\n";
}

}  // namespace holdfast::apps
