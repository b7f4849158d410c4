// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json.hpp>

#include "solver/reach/walk_and_reach.h"
#include "solver/take/take.h"

namespace holdfast {

/// How good a motion is, as metrics.json has it; units in the names.
nlohmann::json MotionJson(const ReachMotion& motion);

/// A take as metrics.json has it: "take" (who, how, when, the table), "summary" (its measures,
/// units in the names), "notes", "per_frame". Of a report with status kTaken.
nlohmann::json TakeJson(const TakeReport& report);

}  // namespace holdfast
