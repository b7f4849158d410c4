// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

#include "apps/common.h"
#include "apps/fit_job.h"

namespace holdfast::apps {

/// Runs every job of a list (ReadJobList) into a folder of result folders: each job on one thread,
/// as many at a time as there are threads, memory flat in their number. `manifest.json` there tells
/// what came of each; a job that fails is told there too and does not stop the rest.
///
/// Stopped at any moment, even killed, and started again it goes on with the jobs that are not done
/// and ends with the same bytes as a run that was not stopped: results hold no wall times and no
/// dates. Throws Error for a folder that holds something else, or results of another list or other
/// options (unless `common.force`: then those are made anew).
Outcome RunFitBatch(const std::filesystem::path& list, const std::filesystem::path& folder,
                    const FitJob& common_job, const CommonOptions& common);

}  // namespace holdfast::apps
