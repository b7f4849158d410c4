// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/body/hand_model.h"
#include "geometry/mesh/distance_grid.h"
#include "solver/grasp/grasp.h"
#include "solver/hand/hand_landmarks.h"

namespace holdfast {

/// Approach of a hand to a grasp that does not sweep the object away: with preshaped fingers along
/// a straight line, after which the fingers close.
struct HandApproach {
  Eigen::Vector3d retreat = Eigen::Vector3d::UnitZ();  ///< unit, object frame: away from the grasp
  double standoff_m = 0.09;                            ///< start of the line
  FingerPose ready = FingerPose::Zero();               ///< fingers on the line
  /// Closing order of the joints: above 0, those near the tips first (fingers hook); below 0, the
  /// knuckles first. The other joints follow after this fraction of the closing.
  double tips_lead = 0.0;
  double openness = 0.0;    ///< of `ready`: 0 is the grasp's fingers, 1 an open hand
  double through_mm = 0.0;  ///< deepest skin in the object on approach, beyond the grasp's own
  double below_mm = 0.0;    ///< deepest skin below the object's bottom on approach
};

/// Fingers at a fraction of the closing: 0 is `ready`, 1 the grasp's.
FingerPose ClosingFingers(const HandApproach& approach, const Grasp& grasp, double share);

/// Finds the line, the preshape and the closing order that stay clearest of the object and of its
/// support plane (`bottom_z`, object frame). Minimizes
///
///   through_mm + 0.2 (skin points inside at once) + 0.5 below_mm
///   + 3 (1 - cos(retreat, usual)) + 3 |openness - 0.6| + |tips_lead|
///
/// over 96 directions, 6 opennesses and 4 closing orders. `usual` is the retreat direction of a
/// hand that comes palm and fingertips first.
HandApproach FindApproach(const HandAnatomy& anatomy, const Grasp& grasp,
                          const DistanceGrid& object, double bottom_z);

}  // namespace holdfast
