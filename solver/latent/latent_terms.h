// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "solver/latent/latent_options.h"
#include "solver/latent/motion_objective.h"

namespace holdfast {

/// The points of a motion of this body: soles, then fingertips.
std::vector<BodyPoint> PointsOf(const LatentBody& body);

/// The joint that is to come to the goal.
int GoalJoint(const LatentOptions& options);

/// What makes a motion a person's: all of the objective but the goal. `motion` is the motion as it
/// is, from which contacts, standing and the way are told; it has PointsOf `body`.
void AddNaturalTerms(const LatentBody& body, const LatentOptions& options, const MotionView& motion,
                     const ReachTask& task, MotionObjective& objective);

/// The goal, for a motion of `frames` frames. `share_done` of the iterations, in [0, 1], sharpens
/// the soft minimum.
void AddGoalTerms(const LatentOptions& options, const ReachTask& task, double share_done,
                  int frames, MotionObjective& objective);

}  // namespace holdfast
