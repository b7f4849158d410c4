// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "geometry/report/report_page.h"

namespace holdfast::apps {

/// Formats a fraction as "12.3 %".
std::string Percent(double share, int digits = 1);

/// One line of a chart. Non-finite values are omitted.
struct ChartLine {
  std::string label;
  std::string color;  ///< CSS
  std::vector<std::pair<double, double>> points;
};

struct LineChart {
  std::string title, x_label, y_label;
  std::vector<ChartLine> lines;
};

/// Returns a figure with inline SVG and a legend, or an empty string if no line has a point.
std::string DrawLineChart(const LineChart& chart);

/// CSS rules of charts, for the style of the page.
extern const char* const kChartStyle;

/// Returns a page up to its first paragraph: head, style (CSS), heading.
std::string PageHead(const std::string& title, const std::string& heading,
                     const std::string& style);

/// CSS rules shared by pages with tables.
extern const char* const kTableStyle;

/// Returns a table of plain text. Heads are optional.
std::string HtmlTable(const std::vector<std::string>& heads,
                      const std::vector<std::vector<std::string>>& rows);

}  // namespace holdfast::apps
