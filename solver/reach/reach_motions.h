// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "generator/wandr/network.h"
#include "generator/wandr/reach_goals.h"
#include "geometry/parallel.h"
#include "solver/body_ik/reach_refit.h"
#include "solver/reach/reach_options.h"

namespace holdfast {

/// Quality of a motion apart from its goals; fractions of its frames.
struct ReachQuality {
  double skating = 0.0;        ///< the lowest vertex moves more than 2/3 cm per frame
  double joint_skating = 0.0;  ///< same for foot joints
  double airborne = 0.0;       ///< all foot joints above 12 cm
  double closest_sum_m = 0.0;  ///< over the goals
  double peak_pelvis_m_s = 0.0;
  int crouches_twice = 0;  ///< number of goals with a second crouch (SecondCrouch)
  /// OffBalance of the last frame, meters; NaN if the person moves there.
  double off_balance_m = 0.0;
};

/// A generated motion, in the world for either side: states and joints of the moving body.
struct ReachMotion {
  wandr::ReachSample sample;
  ReachQuality quality;
  double cost = 0.0;  ///< MotionCost before refitting
  int index = 0;      ///< of the sample, before ranking
  std::optional<RefitReport> refit;
  std::vector<LatentSolve> solves;  ///< of its latents, in order; none by intention
};

struct ReachReport {
  bool stopped = true;               ///< by `progress`
  std::vector<ReachMotion> motions;  ///< best first
  int reach_all = 0;                 ///< number of motions that reach all goals, before refitting
  /// Why the best motion missed each goal; nothing for goals that were reached or never attempted.
  std::vector<std::optional<std::string>> why_missed;
  double seconds = 0.0;  ///< to generate the motions
};

/// Generates motions through these goals of the wrist (world, meters, z up) by `options.by`, in the
/// order of the samples: with cost, but neither quality nor reasons of misses. The network reaches
/// with the right wrist: for the left one everything is mirrored.
ReachReport MakeReachMotions(const ReachPerson& person, const wandr::NetworkWeights& network,
                             std::span<const Eigen::Vector3d> goals, const ReachOptions& options,
                             const StagedProgress& progress = {});

}  // namespace holdfast
