// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "solver/evaluation/reach_study.h"

namespace holdfast::apps {

/// "12.3 %" of a share.
std::string Percent(double share, int digits = 1);

/// Everything up to a page's first paragraph: head, style, heading.
std::string StudyPageHead(const std::string& title);

/// Pieces of SVG; `style` are attributes.
std::string SvgOpen(int width, int height);
std::string SvgText(double x, double y, const std::string& text, const char* anchor = "middle",
                    const char* style = "");

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
  std::vector<double> x, share;
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

/// Share of motions that come within 0 to 1 m of the goal, and a chart of such.
ShareSeries WithinTolerance(const std::string& label, const std::vector<StudyMotion>& motions);
std::string ToleranceChart(std::vector<ShareSeries> series, const std::string& title,
                           int width = 400);

}  // namespace holdfast::apps
