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

/// The rules that it needs in the page's style.
extern const char* const kChartStyle;

}  // namespace holdfast::apps
