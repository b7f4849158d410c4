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
#include "solver/reach/reach_person.h"

/// A person walks to goals of the wrist: motions made, the best one chosen, its feet pinned.
///
///   ReachPerson person = StandingPerson(BodyModel::Default());
///   ReachReport report = WalkAndReach(person, wandr::DefaultNetwork(), {{1.5, 1.0, 1.1}});
///   WriteClip(ClipOf(report.motions.front(), person), "reached.npz");
namespace holdfast {

/// How good a motion is besides its goals; shares of its frames.
struct ReachQuality {
  double skating = 0.0;        ///< the lowest vertex moves more than 2/3 cm per frame
  double joint_skating = 0.0;  ///< the same of foot joints
  double airborne = 0.0;       ///< all foot joints above 12 cm
  double closest_sum_m = 0.0;  ///< over the goals
  double peak_pelvis_m_s = 0.0;
  int crouches_twice = 0;  ///< goals on the way to which it does (SecondCrouch)
};

struct ReachMotion {
  wandr::ReachSample sample;
  ReachQuality quality;
  double cost = 0.0;  ///< MotionCost, of what was made
  int index = 0;      ///< of the sample, before they were ranked
  std::optional<RefitReport> refit;
  std::vector<LatentSolve> solves;  ///< of its latents, in order; none by intention
};

enum class FailureReason {
  kNothing,   ///< it was reached, or never taken on
  kHeight,    ///< too high for this body
  kObstacle,  ///< in one, or too near one for a hand
  kTime,      ///< faster than a walk
  kMotion,    ///< no motion came closer
};

struct ReachMiss {
  FailureReason by = FailureReason::kNothing;
  double distance_m = 0.0;  ///< on the ground, from where the goal was taken on
};

enum class ReachStatus {
  kMade,
  kStopped,   ///< by `progress`
  kDiverged,  ///< the network's numbers broke in every motion
};

struct ReachReport {
  ReachStatus status = ReachStatus::kStopped;
  std::vector<ReachMotion> motions;  ///< best first
  int reach_all = 0;                 ///< how many reach all goals, before they were refitted
  std::vector<ReachMiss> misses;     ///< of the best, for each goal
  double seconds = 0.0;              ///< of making the motions
};

/// What is hard about these goals, as sentences. Throws Error where there is no sense in trying:
/// goals underground, more than 20 m away, or within an obstacle.
std::vector<std::string> CheckReachGoals(std::span<const Eigen::Vector3d> goals,
                                         const ReachPerson& person, const ReachOptions& options);

/// The motion that reaches most goals (world, meters, z up); of those that reach all, and
/// do not crouch twice, the one of least MotionCost, of others with the least sum of closest
/// distances. Feet are pinned and the wrist is placed afterwards (`options.refit`), in the best or
/// in all.
ReachReport WalkAndReach(const ReachPerson& person, const wandr::NetworkWeights& network,
                         std::span<const Eigen::Vector3d> goals, const ReachOptions& options = {},
                         const StagedProgress& progress = {});

/// FitFailure where the numbers of the network (from `source`) broke in every motion.
void RequireMade(const ReachReport& report, const std::string& source);

/// At 30 Hz, on the person's body.
Clip ClipOf(const ReachMotion& motion, const ReachPerson& person);

/// "(1.50, 1.00, 1.10)"
std::string GoalText(const Eigen::Vector3d& goal);

}  // namespace holdfast
