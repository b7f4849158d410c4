// SPDX-License-Identifier: MIT
#pragma once

#include "apps/common.h"

namespace holdfast::apps {

/// Adds `naturalness` to the evaluate command: sets of motions against captured ones, results.json,
/// results.md, motions.csv and report.html in a new folder.
void AddEvaluateNaturalness(CLI::App& evaluate, int& exit_code);

}  // namespace holdfast::apps
