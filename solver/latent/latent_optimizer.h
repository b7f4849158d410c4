// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "generator/wandr/network.h"
#include "solver/latent/latent_options.h"

namespace holdfast {

/// What became of each task. Neither threads, nor batches, nor the other tasks change a result.
/// All tasks have the same number of steps. `progress` sees tasks done; what it throws ends the
/// run. Throws Error for no tasks, unequal steps, deadlines beyond the motion, and what is not
/// finite.
std::vector<ReachSolution> OptimizeLatents(const wandr::Network<float>& network,
                                           const LatentBody& body, std::span<const ReachTask> tasks,
                                           const LatentOptions& options, int threads,
                                           const std::function<void(int, int)>& progress = {});

}  // namespace holdfast
