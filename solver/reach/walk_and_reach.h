// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "generator/wandr/network.h"
#include "geometry/parallel.h"
#include "solver/body_ik/reach_refit.h"
#include "solver/reach/reach_motions.h"
#include "solver/reach/reach_options.h"

/// A person walks to goals of the wrist: generates motions, selects the best, pins its feet.
///
///   ReachPerson person = StandingPerson(BodyModel::Default());
///   ReachReport report = WalkAndReach(person, wandr::DefaultNetwork(), {{1.5, 1.0, 1.1}});
///   WriteClip(ClipOf(report.motions.front(), person), "reached.npz");
namespace holdfast {

/// Quality of a motion apart from its goals; fractions of its frames.
struct ReachQuality {
  double skating = 0.0;        ///< the lowest vertex moves more than 2/3 cm per frame
  double joint_skating = 0.0;  ///< same for foot joints
  double airborne = 0.0;       ///< all foot joints above 12 cm
  double closest_sum_m = 0.0;  ///< over the goals
  double peak_pelvis_m_s = 0.0;
  int crouches_twice = 0;  ///< number of goals with a second crouch (SecondCrouch)
};

struct ReachMotion {
  wandr::ReachSample sample;
  ReachQuality quality;
  double cost = 0.0;  ///< MotionCost before refitting
  int index = 0;      ///< of the sample, before ranking
  std::optional<RefitReport> refit;
  std::vector<LatentSolve> solves;  ///< of its latents, in order; none by intention
};

enum class FailureReason {
  kNothing,   ///< reached, or never attempted
  kHeight,    ///< too high for this body
  kObstacle,  ///< inside one, or too close for a hand
  kTime,      ///< faster than a walk
  kMotion,    ///< no motion came closer
};

struct ReachMiss {
  FailureReason by = FailureReason::kNothing;
  double distance_m = 0.0;  ///< horizontal, from the start of the attempt
};

enum class ReachStatus {
  kMade,
  kStopped,   ///< by `progress`
  kDiverged,  ///< non-finite network output in every motion
};

struct ReachReport {
  ReachStatus status = ReachStatus::kStopped;
  std::vector<ReachMotion> motions;  ///< best first
  int reach_all = 0;                 ///< number of motions that reach all goals, before refitting
  std::vector<ReachMiss> misses;     ///< of the best motion, for each goal
  double seconds = 0.0;              ///< to generate the motions
};

/// Returns difficulties of these goals, as sentences. Throws Error for infeasible goals: below the
/// ground, more than 20 m away, or within an obstacle.
std::vector<std::string> CheckReachGoals(std::span<const Eigen::Vector3d> goals,
                                         const ReachPerson& person, const ReachOptions& options);

/// Returns motions to the goals (world, meters, z up), ranked by goals reached, then by second
/// crouches, then by MotionCost if all goals are reached, otherwise by the sum of closest
/// distances. Then pins feet and places the wrist (`options.refit`), in the best motion or in all.
ReachReport WalkAndReach(const ReachPerson& person, const wandr::NetworkWeights& network,
                         std::span<const Eigen::Vector3d> goals, const ReachOptions& options = {},
                         const StagedProgress& progress = {});

/// Throws FitFailure if the output of the network (from `source`) was not finite in every motion.
void RequireMade(const ReachReport& report, const std::string& source);

/// At 30 Hz, on the person's body.
Clip ClipOf(const ReachMotion& motion, const ReachPerson& person);

/// "(1.50, 1.00, 1.10)"
std::string GoalText(const Eigen::Vector3d& goal);

}  // namespace holdfast
