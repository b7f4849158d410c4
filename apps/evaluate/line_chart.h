// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace holdfast::apps {

/// One line of a chart, with a band about it where `low` and `high` are given (same x as points).
struct ChartLine {
  std::string label;
  std::string colour;  ///< CSS
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
  std::vector<std::pair<std::string, std::string>> series;  ///< label, colour
  std::vector<Row> rows;
};
std::string DrawDotChart(const DotChart& chart);

/// The rules that both need in the page's style.
extern const char* const kChartStyle;

}  // namespace holdfast::apps
