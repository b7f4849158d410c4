// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

#include "apps/common.h"

namespace holdfast::apps {

/// Fits every job of a list (ReadJobList) in three ways, from the same grasps: the paper's terms,
/// the recipe of its authors' code, and all terms; scores the results, and looks for hand-overs in
/// synthetic clips with known switch frames. Writes results, `evaluation.json` and
/// `evaluation.md` (the table) into `folder`; results that are there already are taken as they
/// are. Times are those of one fit at a time.
Outcome EvaluateFit(const std::filesystem::path& list, const std::filesystem::path& folder,
                    int handovers, const CommonOptions& common);

}  // namespace holdfast::apps
