// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "generator/wandr/network.h"
#include "generator/wandr/reach_goals.h"
#include "geometry/parallel.h"
#include "solver/body_ik/reach_refit.h"
#include "solver/reach/reach_options.h"

namespace holdfast {

/// Generated motions, in the world for either side: states and joints of the moving body.
struct ReachMotions {
  std::vector<wandr::ReachSample> samples;
  std::vector<double> costs;                     ///< MotionCost of each sample
  std::vector<RefitReport> refits;               ///< of refitted samples: none, or all
  std::vector<std::vector<LatentSolve>> solves;  ///< of optimized samples: none, or all
  double seconds = 0.0;
  bool stopped = false;  ///< by `progress`
};

/// Generates motions through these goals of the wrist (world, meters, z up) by `options.by`. The
/// network reaches with the right wrist: for the left one everything is mirrored.
ReachMotions MakeReachMotions(const ReachPerson& person, const wandr::NetworkWeights& network,
                              std::span<const Eigen::Vector3d> goals, const ReachOptions& options,
                              const StagedProgress& progress = {});

/// RefitRollout of a motion that was not refitted; the wrist is placed at the goals that the motion
/// reached. Recomputes the outcomes.
RefitReport RefitReach(const ReachPerson& person, std::span<const Eigen::Vector3d> goals, Side side,
                       wandr::ReachSample& sample);

}  // namespace holdfast
