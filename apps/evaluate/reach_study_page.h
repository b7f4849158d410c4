// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "solver/evaluation/captured_reaches.h"

namespace holdfast::apps {

/// One run of a study: all motions of one variant with one rule for deadlines.
struct StudyRun {
  const ReachVariant* variant = nullptr;
  std::string deadline;  ///< "adaptive" or "fixed"
  std::string how;       ///< how the ablation was made: "", "masked" or a file
  wandr::ReachProtocol protocol;
  std::vector<wandr::ReachCase> cases;
  std::vector<StudyMotion> motions;
  StudySummary summary;
};

/// What the page says besides numbers.
struct StudyText {
  std::string title;
  std::vector<std::string> notes;
};

/// Means over the motions that share a place on one axis of the grid.
struct AxisValue {
  std::string label;
  int motions = 0;
  double success = 0.0;
  double distance_m = 0.0;
};
enum class GridAxis { kAngle, kHeight, kDistance, kStart };
std::vector<AxisValue> ByAxis(const StudyRun& run, GridAxis axis);
/// {"by_angle": [{"at": ...}], ...} of all axes, with the number of motions where it `counts`.
nlohmann::json PlacesJson(const StudyRun& run, bool counts);

/// A run by the name that charts have for it.
using NamedRun = std::pair<std::string, const StudyRun*>;
/// Success by height, angle, distance and start pose: a chart each, with bars of all runs.
std::string PlaceCharts(const std::vector<NamedRun>& runs, int width);
/// Share of motions that come within 0 to 1 m of the goal.
std::string ToleranceChart(const std::vector<NamedRun>& runs, const std::string& title, int width);

/// The table, in Markdown.
std::string StudyTable(const std::vector<StudyRun>& runs, const CapturedSkating& captured);
/// One page without scripts: tables, success by height, angle and distance (figure 5 of the paper),
/// from above, and by tolerance.
std::string StudyPage(const StudyText& text, const std::vector<StudyRun>& runs,
                      const CapturedSkating& captured);

}  // namespace holdfast::apps
