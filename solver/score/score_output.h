// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <string>

#include <nlohmann/json.hpp>

#include "solver/score/metric_values.h"

namespace holdfast {

/// For people: one column per clip, and a column each for mean, median and worst of several. More
/// clips than fit: the summary alone, with the worst clip's name, above one line per clip.
std::string ScoreTable(std::span<const ClipScore> scores, const ScoreOptions& options);

/// One line per clip, then mean, median and worst; empty cells where a metric is undefined.
std::string ScoreCsv(std::span<const ClipScore> scores, const ScoreOptions& options);

/// Adds `protocol`, `clips` and `summary` to `json`. Undefined values are null.
void AddScores(std::span<const ClipScore> scores, const ScoreOptions& options, bool per_frame,
               nlohmann::json& json);

}  // namespace holdfast
