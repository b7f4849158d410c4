// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "generator/wandr/network.h"
#include "solver/latent/latent_options.h"

namespace holdfast {

/// Optimizes the latents of each task. Results do not depend on threads, batches, or other tasks.
/// All tasks must have the same number of steps. `progress` receives the number of completed tasks;
/// its exceptions end the run. Throws Error for no tasks, unequal steps, deadlines beyond the
/// motion, and non-finite input.
std::vector<ReachSolution> OptimizeLatents(const wandr::Network<float>& network,
                                           const LatentBody& body, std::span<const ReachTask> tasks,
                                           const LatentOptions& options, int threads,
                                           const std::function<void(int, int)>& progress = {});

}  // namespace holdfast
