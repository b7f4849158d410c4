// SPDX-License-Identifier: MIT
#include "apps/evaluate/line_chart.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "apps/evaluate/reach_study_charts.h"
#include "apps/report/report_page.h"

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

std::string Number(double value) {
  return fmt::format("{:.4g}", std::abs(value) < 1e-12 ? 0.0 : value);  // never "-0"
}

struct Range {
  double low = std::numeric_limits<double>::infinity(), high = -low;

  void Include(double value) {
    if (!std::isfinite(value)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  bool Empty() const { return !(low <= high); }
};

// A legend below a chart: words wrap by themselves there.
std::string Legend(const std::vector<std::pair<std::string, std::string>>& entries) {
  std::string html = "<figcaption>";
  for (const auto& [label, colour] : entries) {
    html +=
        fmt::format("<span><i style=\"background:{}\"></i>{}</span> ", colour, EscapeHtml(label));
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
svg .value { font-size: 9px; } svg .axis { opacity: .75; }
svg .grid { stroke: #8884; } svg .band { fill-opacity: .13; stroke: none; }
svg .tick { stroke: #888; stroke-width: 2; }
)";

std::string DrawLineChart(const LineChart& chart) {
  constexpr double kWidth = 400, kHeight = 250, kLeft = 46, kRight = 12, kTop = 40, kBottom = 38;
  constexpr double kPlotWidth = kWidth - kLeft - kRight, kPlotHeight = kHeight - kTop - kBottom;
  const auto shown = [&](double y) { return std::isfinite(y) && (!chart.logarithmic || y > 0.0); };
  Range xs, ys;
  for (const ChartLine& line : chart.lines) {
    for (std::size_t i = 0; i < line.points.size(); ++i) {
      xs.Include(line.points[i].first);
      if (shown(line.points[i].second)) ys.Include(line.points[i].second);
      if (!line.high.empty() && shown(line.high[i])) ys.Include(line.high[i]);
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
  const auto at_x = [&](double x) {
    return kLeft + kPlotWidth * (x - xs.low) / (xs.high - xs.low);
  };
  const auto at_y = [&](double y) {
    const double value = chart.logarithmic ? std::log10(std::max(y, 1e-300)) : y;
    const double share = std::clamp((value - ys.low) / (ys.high - ys.low), 0.0, 1.0);
    return kTop + kPlotHeight * (1.0 - share);
  };

  std::string svg =
      fmt::format("<figure><svg viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" role=\"img\">",
                  kWidth, kHeight);
  svg += SvgText(4, 14, chart.title, "start", "class=\"title\"");
  svg += SvgText(4, 29, chart.y_label, "start", "class=\"axis\"");
  for (double y = ys.low; y <= ys.high + 1e-9 * step; y += step) {
    const double value = chart.logarithmic ? std::pow(10.0, y) : y;
    svg += fmt::format("<line class=\"grid\" x1=\"{}\" x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\"/>",
                       kLeft, kWidth - kRight, at_y(value), at_y(value));
    svg += SvgText(kLeft - 5, at_y(value) + 4, Number(value), "end");
  }
  const double x_step = RoundStep(xs.high - xs.low, 5);
  for (double x = x_step * std::ceil(xs.low / x_step - 1e-9); x <= xs.high + 1e-9 * x_step;
       x += x_step) {
    svg += SvgText(at_x(x), kHeight - kBottom + 15, Number(x));
  }
  svg += SvgText(kLeft + 0.5 * kPlotWidth, kHeight - 6, chart.x_label, "middle", "class=\"axis\"");
  std::vector<std::pair<std::string, std::string>> entries;
  for (const ChartLine& line : chart.lines) {
    entries.emplace_back(line.label, line.colour);
    if (!line.low.empty()) {
      std::string there, back;
      for (std::size_t i = 0; i < line.points.size(); ++i) {
        const double x = at_x(line.points[i].first);
        there += fmt::format("{:.1f},{:.1f} ", x, at_y(line.high[i]));
        back = fmt::format("{:.1f},{:.1f} ", x, at_y(line.low[i])) + back;
      }
      svg += fmt::format("<polygon class=\"band\" points=\"{}{}\" fill=\"{}\"/>", there, back,
                         line.colour);
    }
    std::string points;
    for (const auto& [x, y] : line.points) {
      if (shown(y)) points += fmt::format("{:.1f},{:.1f} ", at_x(x), at_y(y));
    }
    svg += fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"/>",
                       points, line.colour);
  }
  return svg + "</svg>" + Legend(entries) + "</figure>\n";
}

std::string DrawDotChart(const DotChart& chart) {
  constexpr double kWidth = 860, kLeft = 210, kRight = 40, kTop = 26, kRow = 20, kBottom = 36;
  constexpr double kPlotWidth = kWidth - kLeft - kRight;
  const double height = kTop + kRow * static_cast<double>(chart.rows.size()) + kBottom;
  const auto at_x = [&](double x) {
    return kLeft + kPlotWidth * std::clamp(x / chart.greatest, 0.0, 1.0);
  };
  std::string svg =
      fmt::format("<figure><svg viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" role=\"img\">",
                  kWidth, height);
  svg += SvgText(4, 14, chart.title, "start", "class=\"title\"");
  const double step = RoundStep(chart.greatest, 6);
  for (double x = 0.0; x <= chart.greatest + 1e-9; x += step) {
    svg += fmt::format(
        "<line class=\"grid\" x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2:.1f}\"/>", at_x(x),
        kTop, height - kBottom);
    svg += SvgText(at_x(x), height - kBottom + 15, Number(x));
  }
  svg += SvgText(kLeft + 0.5 * kPlotWidth, height - 5, chart.x_label, "middle", "class=\"axis\"");
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
      const std::string& colour = chart.series[s].second;
      if (s < row.ticks.size() && std::isfinite(row.ticks[s])) {
        svg += fmt::format(
            "<line class=\"tick\" x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1:.1f}\" y2=\"{2:.1f}\"/>",
            at_x(row.ticks[s]), at - 3.0, at + 3.0);
      }
      svg += fmt::format(
          "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\" fill=\"{}\"><title>{}: {}: "
          "{:.2f}</title></circle>",
          at_x(value), at, colour, EscapeHtml(row.label), EscapeHtml(chart.series[s].first), value);
      if (value > chart.greatest) {
        svg += SvgText(at_x(value) + 7, at + 3, fmt::format("{:.3g}", value), "start",
                       "class=\"value\"");
      }
    }
  }
  return svg + "</svg>" + Legend(chart.series) + "</figure>\n";
}

}  // namespace holdfast::apps
