// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <string>

#include <nlohmann/json.hpp>

#include "solver/score/metric_values.h"

namespace holdfast {

/// Table for the terminal: one column per clip, plus mean, median and worst for several clips. For
/// more clips than fit: the summary only, with the worst clip's name, above one line per clip.
std::string ScoreTable(std::span<const ClipScore> scores, const ScoreOptions& options);

/// CSV: one line per clip, then mean, median and worst; empty cells for undefined metrics.
std::string ScoreCsv(std::span<const ClipScore> scores, const ScoreOptions& options);

/// Adds `protocol`, `clips` and `summary` to `json`. Undefined values are null.
void AddScores(std::span<const ClipScore> scores, const ScoreOptions& options, bool per_frame,
               nlohmann::json& json);

}  // namespace holdfast
