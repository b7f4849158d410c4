// SPDX-License-Identifier: MIT
#pragma once

#include "apps/common.h"

namespace holdfast::apps {

/// Adds `evaluate markers`: recordings solved whole, with markers left out, gaps and wrong labels.
void AddEvaluateMarkers(CLI::App& evaluate, int& exit_code);

}  // namespace holdfast::apps
