// SPDX-License-Identifier: MIT
#pragma once

#include "apps/common.h"
#include "apps/evaluate/evaluate_reach.h"

namespace holdfast::apps {

/// Goals that move, jump, and bodies that are pushed, from held-out starts: results.json and
/// results.md in a folder.
Outcome EvaluateTrack(const EvaluateReachOptions& options, const CommonOptions& common);

}  // namespace holdfast::apps
