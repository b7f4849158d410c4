// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include <Eigen/Core>

#include "generator/wandr/reach_goals.h"
#include "solver/latent/latent_options.h"

namespace holdfast {

/// How far a motion to goals of the right wrist (world, meters, z up) is from how people move, by
/// the natural terms (AddNaturalTerms) of what RefitReach leaves as it is: speed, turns, lean,
/// height, joint limits and accelerations. A mean over frames, 0 at best; it compares motions from
/// one start.
double MotionCost(const LatentBody& body, std::span<const Eigen::Vector3d> goals,
                  const wandr::ReachSample& sample);

}  // namespace holdfast
