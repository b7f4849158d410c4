// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/body/hand_model.h"
#include "geometry/mesh/distance_grid.h"
#include "solver/grasp/grasp.h"
#include "solver/hand/hand_postures.h"

namespace holdfast {

/// How a hand comes to a grasp without sweeping the object away: with ready fingers along a
/// straight line, then the fingers close.
struct HandApproach {
  Eigen::Vector3d retreat = Eigen::Vector3d::UnitZ();  ///< unit, object frame: away from the grasp
  double standoff_m = 0.09;                            ///< where the line begins
  FingerPose ready = FingerPose::Zero();               ///< fingers on the line
  /// Which joints close first: above 0 those near the tips (fingers hook), below 0 the knuckles.
  /// The others follow after this share of the closing.
  double tips_lead = 0.0;
  double openness = 0.0;    ///< of `ready`: 0 is the grasp's fingers, 1 an open hand's
  double through_mm = 0.0;  ///< deepest skin in the object on the way, beyond the grasp's own
  double below_mm = 0.0;    ///< deepest skin below the object's bottom on the way
};

/// The fingers at a share of the closing, 0 ready and 1 the grasp's.
FingerPose ClosingFingers(const HandApproach& approach, const Grasp& grasp, double share);

/// The line, the readiness of fingers and their way of closing that keep clearest of the object and
/// of the plane that it stands on (`bottom_z`, its frame). Least of
///
///   through_mm + 0.2 (skin points inside at once) + 0.5 below_mm + 3 (1 - cos(retreat, usual)) + 3
///   |openness - 0.6| + |tips_lead|
///
/// over 96 directions, 6 opennesses and 4 ways of closing. `usual` has the hand come palm and
/// fingertips first.
HandApproach FindApproach(const HandAnatomy& anatomy, const Grasp& grasp,
                          const DistanceGrid& object, double bottom_z);

}  // namespace holdfast
