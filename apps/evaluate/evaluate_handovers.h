// SPDX-License-Identifier: MIT
#pragma once

#include "apps/common.h"

namespace holdfast::apps {

/// Adds `evaluate handovers`: objects passed from hand to hand, and hand-overs found.
void AddEvaluateHandovers(CLI::App& evaluate, int& exit_code);

}  // namespace holdfast::apps
