// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <nlohmann/json.hpp>

#include "solver/carry/carry.h"
#include "solver/carry/refine.h"

namespace holdfast {

/// The hand-overs of a carried clip, a list as in metrics.json: frames, hands, confidence and the
/// receiving hand's grasp.
nlohmann::json SwitchesJson(const HoldLabels& holding, const std::vector<Handover>& handovers);

/// How the arms gave way to the body, and what remains: numbers over the clip, units in the names.
nlohmann::json ClearanceJson(const ClearanceReport& report);

/// What a refinement found: {"holds": [...], "rests": [...]}, units in the names.
nlohmann::json HoldsJson(const RefineResult& result);

}  // namespace holdfast
