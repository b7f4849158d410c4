// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include <Eigen/Core>

#include "generator/wandr/reach_goals.h"
#include "solver/latent/latent_options.h"

namespace holdfast {

/// Deviation of a motion to goals of the right wrist (world, meters, z up) from natural motion:
/// AddNaturalTerms restricted to what RefitReach does not change: speed, turns, lean, height, joint
/// limits and accelerations. Mean over frames, 0 at best; compares motions from one start.
double MotionCost(const LatentBody& body, std::span<const Eigen::Vector3d> goals,
                  const wandr::ReachSample& sample);

}  // namespace holdfast
