// SPDX-License-Identifier: MIT
#pragma once

#include "apps/common.h"

namespace holdfast::apps {

/// Adds `synthesis` to the evaluate command: IMoS's Table 2 by both definitions, and hand and
/// object (SynthesisStudy), as results.json, results.md and report.html beside its blocks.
void AddEvaluateSynthesis(CLI::App& evaluate, int& exit_code);

}  // namespace holdfast::apps
