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

constexpr const char* kChartColors[] = {"#2f6f9f", "#d1495b", "#66a182", "#edae49",
                                        "#6d597a", "#3d9fa8", "#9a6a3a", "#8a8f98"};
const char* SeriesColor(std::size_t series) {
  return kChartColors[series % std::size(kChartColors)];
}

// A round share at or above the greatest value, for the top of an axis.
double AxisTop(double greatest) {
  for (const double top : {0.05, 0.1, 0.2, 0.4, 0.6, 0.8}) {
    if (greatest <= top) return top;
  }
  return 1.0;
}

constexpr int kPlotLeft = 44, kPlotTop = 30, kPlot = 170;  // of the area that is plotted in

// All but what is plotted: title, lines across at quarters of `top` (a share), and the legend below
// in `end`, which closes the figure.
struct ChartFrame {
  std::string svg, end;
};

ChartFrame FrameOf(const std::string& title, const std::vector<std::string>& names, int width,
                   int right, double top) {
  ChartFrame frame;
  double x = kPlotLeft;
  int y = kPlotTop + kPlot + 28;
  for (std::size_t s = 0; s < names.size(); ++s) {
    const double needs = 22.0 + 5.7 * static_cast<double>(names[s].size());
    if (x > kPlotLeft && x + needs > width) {
      x = kPlotLeft;
      y += 15;
    }
    frame.end += fmt::format("<rect x=\"{:.1f}\" y=\"{}\" width=\"9\" height=\"9\" fill=\"{}\"/>",
                             x, y, SeriesColor(s));
    frame.end += SvgText(x + 13, y + 8, names[s], "start");
    x += needs;
  }
  frame.end += "</svg></figure>\n";
  frame.svg = "<figure>" + SvgOpen(width, y + 14);
  frame.svg += SvgText(kPlotLeft, 16, title, "start", "class=\"title\"");
  for (int k = 0; k <= 4; ++k) {
    frame.svg += SvgGrid(kPlotLeft, right, kPlotTop + kPlot * (1.0 - k / 4.0),
                         fmt::format("{:g}", 100.0 * top * k / 4.0));
  }
  return frame;
}

}  // namespace

const char* const kChartStyle = R"(
figure { display: inline-block; margin: .4rem; vertical-align: top; }
figcaption { font-size: 12px; max-width: 400px; }
figcaption span { white-space: nowrap; margin-right: .8em; }
figcaption i { display: inline-block; width: 9px; height: 9px; margin-right: 4px; }
svg { font: 11px system-ui, sans-serif; fill: currentColor; max-width: 100%; }
svg .title { font-size: 13px; font-weight: 600; }
svg .value { font-size: 9px; } svg .axis { opacity: .75; }
svg .grid { stroke: #8884; } svg .band { fill-opacity: .13; stroke: none; }
svg .tick { stroke: #888; stroke-width: 2; }
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

std::string DrawDotChart(const DotChart& chart) {
  constexpr double kWidth = 860, kLeft = 210, kRight = 40, kTop = 26, kRow = 20, kBottom = 36;
  const double height = kTop + kRow * static_cast<double>(chart.rows.size()) + kBottom;
  const ChartAxis at_x{0.0, chart.greatest, kLeft, kWidth - kRight};
  std::string svg = "<figure>" + SvgOpen(kWidth, static_cast<int>(height));
  svg += SvgText(4, 14, chart.title, "start", "class=\"title\"");
  const double step = RoundStep(chart.greatest, 6);
  for (double x = 0.0; x <= chart.greatest + 1e-9; x += step) {
    svg += SvgLine("grid", at_x.At(x), kTop, at_x.At(x), height - kBottom);
    svg += SvgText(at_x.At(x), height - kBottom + 15, AxisNumber(x));
  }
  svg +=
      SvgText(0.5 * (at_x.begin + at_x.end), height - 5, chart.x_label, "middle", "class=\"axis\"");
  for (std::size_t r = 0; r < chart.rows.size(); ++r) {
    const DotChart::Row& row = chart.rows[r];
    const double y = kTop + kRow * (static_cast<double>(r) + 0.5);
    svg += SvgText(kLeft - 10, y + 4, row.label, "end");
    // Series lie a little apart, so that equal values are both seen.
    const double apart = std::min(6.0, 14.0 / static_cast<double>(chart.series.size()));
    for (std::size_t s = 0; s < row.values.size(); ++s) {
      const double value = row.values[s];
      if (!std::isfinite(value)) continue;
      const double at =
          y + apart * (static_cast<double>(s) - 0.5 * static_cast<double>(row.values.size() - 1));
      const std::string& color = chart.series[s].second;
      if (s < row.ticks.size() && std::isfinite(row.ticks[s])) {
        const double tick = at_x.At(row.ticks[s]);
        svg += SvgLine("tick", tick, at - 3.0, tick, at + 3.0);
      }
      svg += fmt::format(
          "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\" fill=\"{}\"><title>{}: {}: "
          "{:.2f}</title></circle>",
          at_x.At(value), at, color, EscapeHtml(row.label), EscapeHtml(chart.series[s].first),
          value);
      if (value > chart.greatest) {
        svg += SvgText(at_x.At(value) + 7, at + 3, fmt::format("{:.3g}", value), "start",
                       "class=\"value\"");
      }
    }
  }
  return svg + "</svg>" + LegendBelow(chart.series) + "</figure>\n";
}

std::string BarChart(const Bars& bars) {
  const int width = bars.width;
  double greatest = 0.0;
  for (const auto& [name, values] : bars.series) {
    for (const double value : values) greatest = std::max(greatest, value);
  }
  const double top = AxisTop(greatest), plot = kPlot;
  std::vector<std::string> names;
  for (const auto& [name, values] : bars.series) names.push_back(name);
  const ChartFrame frame = FrameOf(bars.title, names, width, width - 8, top);
  std::string svg = frame.svg;
  const double group = (width - 8.0 - kPlotLeft) / static_cast<double>(bars.labels.size());
  const double bar = 0.7 * group / static_cast<double>(bars.series.size());
  for (std::size_t s = 0; s < bars.series.size(); ++s) {
    for (std::size_t i = 0; i < bars.labels.size(); ++i) {
      const double value = bars.series[s].second[i], height = plot * value / top;
      const double x =
          kPlotLeft + group * (static_cast<double>(i) + 0.15) + bar * static_cast<double>(s);
      svg += fmt::format(
          "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" "
          "fill=\"{}\"><title>{}: "
          "{}</title></rect>",
          x, kPlotTop + plot - height, bar - 1.0, height, SeriesColor(s),
          EscapeHtml(bars.series[s].first), Percent(value));
      svg += SvgText(x + 0.5 * bar, kPlotTop + plot - height - 3,
                     fmt::format("{:.0f}", 100.0 * value), "middle", "class=\"value\"");
    }
  }
  for (std::size_t i = 0; i < bars.labels.size(); ++i) {
    svg += SvgText(kPlotLeft + group * (static_cast<double>(i) + 0.5), kPlotTop + kPlot + 18,
                   bars.labels[i]);
  }
  return svg + frame.end;
}

std::string ShareChart(const ShareLines& lines) {
  const int right = lines.width - 24;
  const ChartAxis x{lines.ticks.front().first, lines.ticks.back().first, kPlotLeft,
                    static_cast<double>(right), lines.logarithmic};
  const ChartAxis y{0.0, 1.0, kPlotTop + kPlot, kPlotTop};
  std::vector<std::string> names;
  for (const ShareSeries& series : lines.series) names.push_back(series.label);
  const ChartFrame frame = FrameOf(lines.title, names, lines.width, right, 1.0);
  std::string svg = frame.svg;
  for (const auto& [at, label] : lines.ticks) svg += SvgText(x.At(at), y.begin + 15, label);
  if (lines.limit > 0.0) {
    svg += SvgLine("limit", x.At(lines.limit), y.end, x.At(lines.limit), y.begin);
  }
  for (std::size_t s = 0; s < lines.series.size(); ++s) {
    const ShareSeries& series = lines.series[s];
    svg += SvgPolyline(series.points, x, y, SeriesColor(s),
                       series.dashed ? " stroke-dasharray=\"6 4\"" : "", series.label);
  }
  return svg + frame.end;
}

}  // namespace holdfast::apps
