// SPDX-License-Identifier: MIT
#pragma once

#include "apps/evaluate/evaluate_reach.h"

namespace holdfast::apps {

/// Whether what is asked goes beyond the paper's own tables: other methods, or a part of the goals.
bool ComparesMethods(const EvaluateReachOptions& options);

/// The methods side by side on the first `goals` cases of the protocol (SpreadCases): blocks of
/// motions, results.json, results.md and report.html in a folder, continued when it is there.
FitOutcome CompareReachMethods(const EvaluateReachOptions& options, const CommonOptions& common);

}  // namespace holdfast::apps
