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
  double contact_reach_m = 0.008;      ///< pads nearer than this are attracted to the surface
  double press_m = 0.0004;             ///< target penetration of pads
  int rounds = 2;                      ///< the active points are updated in each
  int iterations = 15;                 ///< of Levenberg-Marquardt, per round
};

/// Parts of the object inside a hand with these vertices (3 x n, wrist frame).
using FindIntrusions =
    std::function<std::vector<Intrusion>(const Eigen::Matrix3Xd&, const Eigen::Isometry3d&)>;

/// Refines a closed hand and its object by least squares: pads on the surface, no penetration,
/// angles within their limits and near the given ones. All 45 finger parameters and the object pose
/// are optimized jointly. `angles` and `wrist_from_object` are the initial values and the result.
/// What `find_intrusions` finds at the start of a round is pushed out as well.
void RefineGrasp(const HandAnatomy& anatomy, HandEvaluation& hand, const DistanceGrid& object,
                 const RefinementOptions& options, HandAngles& angles,
                 Eigen::Isometry3d& wrist_from_object, const FindIntrusions& find_intrusions = {});

}  // namespace holdfast
