// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Geometry>

#include "geometry/mesh/distance_grid.h"
#include "solver/grasp/finger_closing.h"

namespace holdfast {

struct RefinementOptions {
  double penetration_weight = 3000.0;  ///< per metre
  double contact_weight = 300.0;       ///< per metre
  double collision_weight = 1500.0;    ///< per metre, finger against finger
  double contact_reach_m = 0.008;      ///< pads nearer than this are drawn to the surface
  double press_m = 0.0004;             ///< how deep pads press
  int rounds = 2;                      ///< points are chosen anew in each
  int iterations = 15;                 ///< of Levenberg-Marquardt, per round
};

/// Refines a closed hand and its object by least squares: pads onto the surface, nothing inside it,
/// angles within their ranges and near those given. All 45 finger numbers and the object's pose
/// move, together. `angles` and `wrist_from_object` are the start and the result.
void RefineGrasp(const HandAnatomy& anatomy, HandEvaluation& hand, const DistanceGrid& object,
                 const RefinementOptions& options, HandAngles& angles,
                 Eigen::Isometry3d& wrist_from_object);

}  // namespace holdfast
