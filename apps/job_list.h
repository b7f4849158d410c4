// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/fit_job.h"

namespace holdfast::apps {

/// Many fits in one file: a job on each line,
///
///   CLIP OBJECT [hand=right|left|both|auto] [name=NAME] [start=N] [end=N] [object-scale=X]
///
/// Paths are relative to the file and may be embedded names; quotes ("...") hold what has spaces; #
/// begins a comment. Everything else comes from `common_job`. Names are made of clip and object
/// where left out, and numbered where they would repeat.
///
/// Returns the jobs with `output` set to the name. Throws Error with file and line for a line that
/// does not read, an unknown key, a repeated name, or no job at all.
std::vector<FitJob> ReadJobList(const std::filesystem::path& path, const FitJob& common_job);

}  // namespace holdfast::apps
