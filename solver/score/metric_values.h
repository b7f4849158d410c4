// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "solver/score/clip_score.h"

namespace holdfast {

/// A metric as the table, the CSV and the JSON name it. docs/metrics.md says more about each.
struct MetricDefinition {
  enum class Group { kContact, kJitter, kBody, kMotion, kReference };
  enum class Worse { kHigher, kLower };

  std::string key;    ///< unit in the name
  std::string label;  ///< for the table, without the unit
  std::string unit;   ///< "%" for keys that end in _ratio and are shares of one
  int digits = 2;     ///< behind the point, in the table
  Worse worse = Worse::kHigher;
  Group group = Group::kContact;
  bool per_hand = false;      ///< also given for each hand
  bool hand_surface = false;  ///< depends on the surface of the body model
  std::string definition;     ///< what is measured, with the thresholds in use
};

/// All metrics, in the order of the table. `options` gives the thresholds their definitions name.
std::vector<MetricDefinition> MetricDefinitions(const ScoreOptions& options);

/// Values by key; nothing where undefined.
using MetricValues = std::map<std::string, std::optional<double>>;

/// Of the whole clip, hands together.
MetricValues ClipValues(const ClipScore& score, const ScoreOptions& options);
/// Of one hand.
MetricValues HandValues(const ClipScore& score, std::size_t hand, const ScoreOptions& options);

/// One metric over several clips.
struct MetricSummary {
  int count = 0;  ///< clips that have it
  double mean = 0.0, median = 0.0, worst = 0.0;
  std::size_t worst_clip = 0;
};

/// Nothing when no clip has it. Of equally bad clips the first is named.
std::optional<MetricSummary> SummarizeMetric(const MetricDefinition& metric,
                                             std::span<const MetricValues> clips);

}  // namespace holdfast
