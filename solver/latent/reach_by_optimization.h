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

/// How goals one after another are reached by optimization.
struct ReachByOptimizationOptions {
  bool as_published = false;  ///< VaeOptOptions in place of LatentOptions
  LatentOptions latent;
  VaeOptOptions vae;

  std::optional<int> frames;  ///< for each goal; empty: WalkPace's, as published by the rule
  wandr::DeadlineRule deadline{.max_frames = 900.0};  ///< as published
  /// Frames for which the wrist stays at each goal (the last one's too); empty: 16 each.
  std::vector<int> stay_frames;
  /// Unit vectors along the forearm on arrival; empty, or one for each goal, zero for any.
  std::vector<Eigen::Vector3d> approaches;
  /// Missed goals are tried again, from other latents and with half as much time again.
  int retries = 2;
  bool refit = true;
  std::uint64_t seed = 1;
};

/// What reaches by optimization, and the last touch.
struct OptimizedReach {
  wandr::ReachSample sample;
  RefitReport refit;
  std::vector<LatentSolve> solves;  ///< of the parts that were kept, in order
};

/// Makes `count` motions from the same start through all goals, each goal's part optimized by
/// itself from where the one before ended. Motion i starts from latents of stream i; neither
/// threads nor the number of motions changes one. The wrist is the right one (wandr::MirroredStates
/// for the left). `progress` sees parts done; what it throws ends the run. Throws Error for no
/// goals, and what OptimizeLatents and OptimizeAsPublished throw.
std::vector<OptimizedReach> ReachByOptimization(const wandr::Network<float>& network,
                                                const BodyMeasures& measures,
                                                const wandr::RolloutStart<float>& start,
                                                std::span<const Eigen::Vector3d> goals, int count,
                                                int threads,
                                                const ReachByOptimizationOptions& options,
                                                const std::function<void(int, int)>& progress = {});

}  // namespace holdfast
