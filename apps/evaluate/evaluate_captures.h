// SPDX-License-Identifier: MIT
#pragma once

#include "apps/common.h"

namespace holdfast::apps {

/// Adds `evaluate captures`: captured clips with objects, before and after `refine`.
void AddEvaluateCaptures(CLI::App& evaluate, int& exit_code);

}  // namespace holdfast::apps
