// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json.hpp>

#include "solver/reach/walk_and_reach.h"

namespace holdfast {

/// How good a motion is, as metrics.json has it; units in the names.
nlohmann::json MotionJson(const ReachMotion& motion);

}  // namespace holdfast
