// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "solver/score/clip_score.h"

namespace holdfast {

/// Name and metadata of a metric in the table, CSV and JSON. docs/metrics.md has details.
struct MetricDefinition {
  enum class Group { kContact, kProtocol, kJitter, kBody, kStanding, kMotion, kReference };
  enum class Worse { kHigher, kLower };

  std::string key;    ///< includes the unit
  std::string label;  ///< for the table, without the unit
  std::string unit;   ///< "%" for keys that end in _ratio, whose values are fractions
  int digits = 2;     ///< decimals in the table
  Worse worse = Worse::kHigher;
  Group group = Group::kContact;
  bool per_hand = false;      ///< also given per hand
  bool hand_surface = false;  ///< depends on the surface of the body model
  std::string definition;     ///< definition with the current thresholds
};

/// All metrics, in table order. `options` gives the thresholds named in their definitions.
std::vector<MetricDefinition> MetricDefinitions(const ScoreOptions& options);

/// Values by key; none if undefined.
using MetricValues = std::map<std::string, std::optional<double>>;

/// Values of the whole clip, over all hands.
MetricValues ClipValues(const ClipScore& score, const ScoreOptions& options);
/// Values of one hand.
MetricValues HandValues(const ClipScore& score, std::size_t hand, const ScoreOptions& options);

/// One metric over several clips.
struct MetricSummary {
  int count = 0;  ///< clips with a value
  double mean = 0.0, median = 0.0, worst = 0.0;
  std::size_t worst_clip = 0;
};

/// Nothing if no clip has a value. Ties for the worst go to the first clip.
std::optional<MetricSummary> SummarizeMetric(const MetricDefinition& metric,
                                             std::span<const MetricValues> clips);

}  // namespace holdfast
