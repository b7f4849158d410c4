// SPDX-License-Identifier: MIT
#pragma once

#include "apps/common.h"

namespace holdfast::apps {

/// Adds `evaluate hold`: grasps of many objects tried by simulation.
void AddEvaluateHold(CLI::App& evaluate, int& exit_code);

}  // namespace holdfast::apps
