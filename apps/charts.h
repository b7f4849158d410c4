// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace holdfast::apps {

/// "12.3 %" of a share.
std::string Percent(double share, int digits = 1);

/// Pieces of SVG, in its pixels; `style` are attributes.
std::string SvgOpen(int width, int height);
std::string SvgText(double x, double y, const std::string& text, const char* anchor = "middle",
                    const char* style = "");
std::string SvgLine(const char* kind, double x1, double y1, double x2, double y2);
/// A line across, with its value to the left.
std::string SvgGrid(double x1, double x2, double y, const std::string& label);

/// The numbers that a chart must show.
struct ChartRange {
  double low = std::numeric_limits<double>::infinity(), high = -low;

  /// Leaves out what is not finite.
  void Include(double value);
  bool Empty() const { return !(low <= high); }
};

/// Where values from `low` to `high` stand: at pixels `begin` to `end`, as do those beyond.
struct ChartAxis {
  double low, high, begin, end;
  bool logarithmic = false;

  double At(double value) const;
  /// Whether a value has a place: a number, positive where the axis is logarithmic.
  bool Has(double value) const;
};
/// A line through those points that have a place; `style` are attributes.
std::string SvgPolyline(const std::vector<std::pair<double, double>>& points, const ChartAxis& x,
                        const ChartAxis& y, const std::string& color, const char* style = "",
                        const std::string& title = "");

/// One line of a chart, with a band about it where `low` and `high` are given (same x as points).
struct ChartLine {
  std::string label;
  std::string color;  ///< CSS
  std::vector<std::pair<double, double>> points;
  std::vector<double> low, high;
};

struct LineChart {
  std::string title, x_label, y_label;
  bool logarithmic = false;  ///< y; values that are not positive are left out
  std::vector<ChartLine> lines;
};

/// A figure with inline SVG and a legend; empty when no line has a point.
std::string DrawLineChart(const LineChart& chart);

/// Rows of dots on one axis from 0, such as the distances of several sets by several measures.
struct DotChart {
  struct Row {
    std::string label;
    std::vector<double> values;  ///< one per series; NaN draws none
    std::vector<double> ticks;   ///< one per series: a mark that the value is to be compared with
  };
  std::string title, x_label;
  double greatest = 6.0;  ///< end of the axis; what is beyond stands at the end, with its number
  std::vector<std::pair<std::string, std::string>> series;  ///< label, color
  std::vector<Row> rows;
};
std::string DrawDotChart(const DotChart& chart);

/// The rules that these two need in the page's style.
extern const char* const kChartStyle;

/// Groups of bars: one group per label, one bar per series.
struct Bars {
  std::string title;
  std::vector<std::string> labels;
  std::vector<std::pair<std::string, std::vector<double>>> series;  ///< shares in [0, 1]
  int width = 400;
};
std::string BarChart(const Bars& bars);

/// Shares in [0, 1] over a quantity.
struct ShareSeries {
  std::string label;
  std::vector<std::pair<double, double>> points;  ///< quantity, share
  bool dashed = false;
};
struct ShareLines {
  std::string title;
  std::vector<ShareSeries> series;
  std::vector<std::pair<double, std::string>> ticks;  ///< along x; the first and last are its ends
  bool logarithmic = false;                           ///< in x
  double limit = 0.0;                                 ///< a dashed line across, where within range
  int width = 400;
};
std::string ShareChart(const ShareLines& lines);

}  // namespace holdfast::apps
