// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace holdfast::apps {

/// "12.3 %" of a share.
std::string Percent(double share, int digits = 1);

/// One line of a chart; values that are not finite are left out.
struct ChartLine {
  std::string label;
  std::string color;  ///< CSS
  std::vector<std::pair<double, double>> points;
};

struct LineChart {
  std::string title, x_label, y_label;
  std::vector<ChartLine> lines;
};

/// A figure with inline SVG and a legend; empty when no line has a point.
std::string DrawLineChart(const LineChart& chart);

/// The rules that it needs in the page's style.
extern const char* const kChartStyle;

}  // namespace holdfast::apps
