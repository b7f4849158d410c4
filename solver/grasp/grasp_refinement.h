// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <vector>

#include <Eigen/Geometry>

#include "geometry/mesh/distance_grid.h"
#include "solver/grasp/finger_closing.h"
#include "solver/terms/hand/penetration.h"

namespace holdfast {

struct RefinementOptions {
  double penetration_weight = 3000.0;  ///< per meter
  double contact_weight = 300.0;       ///< per meter
  double collision_weight = 1500.0;    ///< per meter, finger against finger
  double contact_reach_m = 0.008;      ///< pads nearer than this are drawn to the surface
  double press_m = 0.0004;             ///< how deep pads press
  int rounds = 2;                      ///< points are chosen anew in each
  int iterations = 15;                 ///< of Levenberg-Marquardt, per round
};

/// What of the object is in a hand with these vertices (3 x n, wrist's frame).
using FindIntrusions =
    std::function<std::vector<Intrusion>(const Eigen::Matrix3Xd&, const Eigen::Isometry3d&)>;

/// Refines a closed hand and its object by least squares: pads onto the surface, nothing inside it,
/// angles within their ranges and near those given. All 45 finger numbers and the object's pose
/// move, together. `angles` and `wrist_from_object` are the start and the result. What
/// `find_intrusions` finds where a round begins is pushed out, too.
void RefineGrasp(const HandAnatomy& anatomy, HandEvaluation& hand, const DistanceGrid& object,
                 const RefinementOptions& options, HandAngles& angles,
                 Eigen::Isometry3d& wrist_from_object, const FindIntrusions& find_intrusions = {});

}  // namespace holdfast
