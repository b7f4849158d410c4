// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "generator/wandr/reach_goals.h"
#include "solver/latent/latent_options.h"
#include "solver/latent/motion_objective.h"

namespace holdfast {

/// Points on this body used in a motion: soles, then fingertips.
std::vector<BodyPoint> PointsOf(const LatentBody& body);

/// The joint that has to reach the goal.
int GoalJoint(const LatentOptions& options);

/// Adds the naturalness terms: the whole objective except the goal. Contacts, standing and the path
/// are determined from the current `motion`, which has the PointsOf `body`.
void AddNaturalTerms(const LatentBody& body, const LatentOptions& options, const MotionView& motion,
                     const ReachTask& task, MotionObjective& objective);

/// Adds the goal terms for a motion of `frames` frames. `share_done`, the fraction of completed
/// iterations in [0, 1], sharpens the soft minimum.
void AddGoalTerms(const LatentOptions& options, const ReachTask& task, double share_done,
                  int frames, MotionObjective& objective);

/// Deviation of a motion to goals of the right wrist (world, meters, z up) from natural motion:
/// AddNaturalTerms restricted to what RefitReach does not change: speed, turns, lean, height, joint
/// limits and accelerations. Mean over frames, 0 at best; compares motions from one start.
double MotionCost(const LatentBody& body, std::span<const Eigen::Vector3d> goals,
                  const wandr::ReachSample& sample);

}  // namespace holdfast
