// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "generator/wandr/network.h"
#include "geometry/parallel.h"
#include "solver/reach/reach_motions.h"
#include "solver/reach/reach_options.h"

/// A person walks to goals of the wrist: generates motions, selects the best, pins its feet.
///
///   ReachPerson person = StandingPerson(BodyModel::Default());
///   ReachReport report = WalkAndReach(person, wandr::DefaultNetwork(), {{1.5, 1.0, 1.1}});
///   WriteClip(ClipOf(report.motions.front(), person), "reached.npz");
namespace holdfast {

/// Returns difficulties of these goals, as sentences. Throws Error for infeasible goals: below the
/// ground, more than 20 m away, or within an obstacle.
std::vector<std::string> CheckReachGoals(std::span<const Eigen::Vector3d> goals,
                                         const ReachPerson& person, const ReachOptions& options);

/// Returns motions to the goals (world, meters, z up), ranked by goals reached, then by second
/// crouches, then by MotionCost if all goals are reached, otherwise by the sum of closest
/// distances. Then pins feet and places the wrist (`options.refit`), in the best motion or in all;
/// of the first six that reach as many goals, the first without a second crouch that ends in
/// balance becomes the best.
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
