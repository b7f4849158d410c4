// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "generator/scripted/reach_motion.h"
#include "generator/wandr/network.h"
#include "generator/wandr/reach_goals.h"
#include "solver/body_ik/reach_refit.h"
#include "solver/latent/latent_optimizer.h"
#include "solver/latent/vae_opt.h"

namespace holdfast {

/// Options for reaching a sequence of goals by optimization.
struct ReachByOptimizationOptions {
  bool as_published = false;  ///< VaeOptOptions instead of LatentOptions
  LatentOptions latent;
  VaeOptOptions vae;

  std::optional<int> frames;  ///< per goal; empty: from WalkPace, or as published from the rule
  /// Frames for which the wrist stays at each goal, including the last; empty: 16 each.
  std::vector<int> stay_frames;
  bool refit = true;
  std::uint64_t seed = 1;
};

/// Optimized reaches, with the final refit.
struct OptimizedReach {
  wandr::ReachSample sample;
  RefitReport refit;
  std::vector<LatentSolve> solves;  ///< of the kept parts, in order
};

/// Generates `count` motions from the same start through all goals; the part of each goal is
/// optimized separately from the end of the previous one. Motion i starts from latents of stream i;
/// results do not depend on threads or `count`. Uses the right wrist (wandr::MirroredStates for the
/// left). `progress` receives the number of completed parts; its exceptions end the run. Throws
/// Error for no goals, and as OptimizeLatents and OptimizeAsPublished do.
std::vector<OptimizedReach> ReachByOptimization(const wandr::Network<float>& network,
                                                const BodyMeasures& measures,
                                                const wandr::RolloutStart<float>& start,
                                                std::span<const Eigen::Vector3d> goals, int count,
                                                int threads,
                                                const ReachByOptimizationOptions& options,
                                                const std::function<void(int, int)>& progress = {});

}  // namespace holdfast
