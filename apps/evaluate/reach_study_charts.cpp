// SPDX-License-Identifier: MIT
#include "apps/evaluate/reach_study_charts.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "apps/report/report_page.h"

namespace holdfast::apps {
namespace {

constexpr const char* kChartColours[] = {"#2f6f9f", "#d1495b", "#66a182", "#edae49",
                                         "#6d597a", "#3d9fa8", "#9a6a3a", "#8a8f98"};
const char* SeriesColour(std::size_t series) {
  return kChartColours[series % std::size(kChartColours)];
}

// A round share at or above the greatest value, for the top of an axis.
double AxisTop(double greatest) {
  for (const double top : {0.05, 0.1, 0.2, 0.4, 0.6, 0.8}) {
    if (greatest <= top) return top;
  }
  return 1.0;
}

// Names beside squares, in rows, and where they end.
struct Legend {
  std::string svg;
  int bottom = 0;
};

Legend LegendOf(const std::vector<std::string>& names, int left, int top, int width) {
  Legend legend;
  double x = left;
  int y = top;
  for (std::size_t s = 0; s < names.size(); ++s) {
    const double needs = 22.0 + 5.7 * static_cast<double>(names[s].size());
    if (x > left && x + needs > width) {
      x = left;
      y += 15;
    }
    legend.svg += fmt::format("<rect x=\"{:.1f}\" y=\"{}\" width=\"9\" height=\"9\" fill=\"{}\"/>",
                              x, y, SeriesColour(s));
    legend.svg += SvgText(x + 13, y + 8, names[s], "start");
    x += needs;
  }
  legend.bottom = y + 14;
  return legend;
}

constexpr int kLeft = 44, kTop = 30, kPlot = 170;  // of the area that is plotted in

// All but what is plotted: title, lines across at quarters of `top` (a share), and the legend below
// in `end`, which closes the figure.
struct Frame {
  std::string svg, end;
};

Frame FrameOf(const std::string& title, const std::vector<std::string>& names, int width, int right,
              double top) {
  const Legend legend = LegendOf(names, kLeft, kTop + kPlot + 28, width);
  Frame frame{"<figure>" + SvgOpen(width, legend.bottom), legend.svg + "</svg></figure>\n"};
  frame.svg += SvgText(kLeft, 16, title, "start", "class=\"title\"");
  for (int k = 0; k <= 4; ++k) {
    const double y = kTop + kPlot * (1.0 - k / 4.0);
    frame.svg +=
        fmt::format("<line class=\"grid\" x1=\"{}\" x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\"/>", kLeft,
                    right, y, y);
    frame.svg += SvgText(kLeft - 5, y + 4, fmt::format("{:g}", 100.0 * top * k / 4.0), "end");
  }
  return frame;
}

constexpr const char* kStudyHeadStyle = R"(
:root { color-scheme: light dark; }
body { font: 15px/1.5 system-ui, sans-serif; max-width: 84rem; margin: 2rem auto; padding: 0 1rem; }
table { border-collapse: collapse; margin: .5rem 0 1.5rem; font-variant-numeric: tabular-nums; }
th, td { padding: .3rem .45rem; text-align: right; white-space: nowrap; border-bottom: 1px solid #8886; }
th:first-child, td:first-child { text-align: left; }
tr.full td { font-weight: 600; }
table.many th:not(:first-child) { white-space: normal; max-width: 5.2rem; vertical-align: bottom; }
table.many td:first-child { white-space: normal; min-width: 11rem; }
.scroll { overflow-x: auto; }
figure { display: inline-block; margin: .4rem; }
svg { font: 11px system-ui, sans-serif; fill: currentColor; }
svg .title { font-size: 13px; font-weight: 600; }
svg .value { font-size: 9px; opacity: .75; }
svg .grid { stroke: #8884; } svg .limit { stroke: #888; stroke-dasharray: 4 3; }
svg .place { stroke: #2f6f9f88; } svg .person { fill: #888; } svg .light { fill: #fff; }
)";

}  // namespace

std::string Percent(double share, int digits) {
  return fmt::format("{:.{}f} %", 100.0 * share, digits);
}

std::string StudyPageHead(const std::string& title) {
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n<meta name=\"viewport\" "
      "content=\"width=device-width, initial-scale=1\">\n<title>{0}</title><style>{1}</style>"
      "</head><body>\n<h1>{0}</h1>\n",
      EscapeHtml(title), kStudyHeadStyle);
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

std::string BarChart(const Bars& bars) {
  const int width = bars.width;
  double greatest = 0.0;
  for (const auto& [name, values] : bars.series) {
    for (const double value : values) greatest = std::max(greatest, value);
  }
  const double top = AxisTop(greatest), plot = kPlot;
  std::vector<std::string> names;
  for (const auto& [name, values] : bars.series) names.push_back(name);
  const Frame frame = FrameOf(bars.title, names, width, width - 8, top);
  std::string svg = frame.svg;
  const double group = (width - 8.0 - kLeft) / static_cast<double>(bars.labels.size());
  const double bar = 0.7 * group / static_cast<double>(bars.series.size());
  for (std::size_t s = 0; s < bars.series.size(); ++s) {
    for (std::size_t i = 0; i < bars.labels.size(); ++i) {
      const double value = bars.series[s].second[i], height = plot * value / top;
      const double x =
          kLeft + group * (static_cast<double>(i) + 0.15) + bar * static_cast<double>(s);
      svg += fmt::format(
          "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" "
          "fill=\"{}\"><title>{}: "
          "{}</title></rect>",
          x, kTop + plot - height, bar - 1.0, height, SeriesColour(s),
          EscapeHtml(bars.series[s].first), Percent(value));
      svg += SvgText(x + 0.5 * bar, kTop + plot - height - 3, fmt::format("{:.0f}", 100.0 * value),
                     "middle", "class=\"value\"");
    }
  }
  for (std::size_t i = 0; i < bars.labels.size(); ++i) {
    svg +=
        SvgText(kLeft + group * (static_cast<double>(i) + 0.5), kTop + kPlot + 18, bars.labels[i]);
  }
  return svg + frame.end;
}

std::string ShareChart(const ShareLines& lines) {
  const int width = lines.width;
  const double plot_w = width - kLeft - 24;
  const auto on_axis = [&](double x) { return lines.logarithmic ? std::log(x) : x; };
  const double low = on_axis(lines.ticks.front().first), high = on_axis(lines.ticks.back().first);
  const auto place = [&](double x) {
    return kLeft + plot_w * std::clamp((on_axis(x) - low) / (high - low), 0.0, 1.0);
  };
  std::vector<std::string> names;
  for (const ShareSeries& series : lines.series) names.push_back(series.label);
  const Frame frame = FrameOf(lines.title, names, width, width - 24, 1.0);
  std::string svg = frame.svg;
  for (const auto& [x, label] : lines.ticks) svg += SvgText(place(x), kTop + kPlot + 15, label);
  if (lines.limit > 0.0) {
    svg +=
        fmt::format("<line class=\"limit\" x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\"/>",
                    place(lines.limit), kTop, kTop + kPlot);
  }
  for (std::size_t s = 0; s < lines.series.size(); ++s) {
    const ShareSeries& series = lines.series[s];
    std::string points;
    for (std::size_t k = 0; k < series.x.size(); ++k) {
      points +=
          fmt::format("{:.1f},{:.1f} ", place(series.x[k]), kTop + kPlot * (1.0 - series.share[k]));
    }
    svg += fmt::format(
        "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"{}><title>{}"
        "</title></polyline>",
        points, SeriesColour(s), series.dashed ? " stroke-dasharray=\"6 4\"" : "",
        EscapeHtml(series.label));
  }
  return svg + frame.end;
}

ShareSeries WithinTolerance(const std::string& label, const std::vector<StudyMotion>& motions) {
  std::vector<double> distances;
  for (const StudyMotion& motion : motions) distances.push_back(motion.outcome.closest_m);
  std::ranges::sort(distances);
  ShareSeries series{label, {}, {}};
  for (int k = 0; k <= 100; ++k) {
    const auto count = std::ranges::upper_bound(distances, 0.01 * k) - distances.begin();
    series.x.push_back(0.01 * k);
    series.share.push_back(static_cast<double>(count) / static_cast<double>(distances.size()));
  }
  return series;
}

std::string ToleranceChart(std::vector<ShareSeries> series, const std::string& title, int width) {
  ShareLines lines{title, std::move(series), {}};
  for (int k = 0; k <= 4; ++k) lines.ticks.emplace_back(0.25 * k, fmt::format("{} cm", 25 * k));
  lines.limit = wandr::kReachedWithin;
  lines.width = width;
  return ShareChart(lines);
}

}  // namespace holdfast::apps
