// SPDX-License-Identifier: MIT
#pragma once

#include <array>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/mesh/distance_grid.h"
#include "solver/hand/hand_landmarks.h"

namespace holdfast {

/// Which fingers close, and how deep a step may penetrate, meters, before it is undone.
inline constexpr std::array<bool, kNumFingers> kAllFingers = {true, true, true, true, true};
inline constexpr double kClosingDepth_m = 0.0015;

struct Closing {
  HandAngles angles;
  std::array<bool, kNumHandParts> touching{};  ///< per hand part
  std::array<bool, kNumFingers> finger_touching{};
};

/// Closes the fingers by touch, without knowledge of the object. All joints of a finger flex. When
/// a phalanx touches, the joints proximal to it stop and the distal ones continue until the
/// fingertip touches, a limit is reached, or another finger or the palm is in the way. Fingers that
/// touch nothing take the flexion of a touching neighbor. `wrist_from_object` is fixed.
Closing CloseFingers(const HandAnatomy& anatomy, HandEvaluation& hand, const DistanceGrid& object,
                     const Eigen::Isometry3d& wrist_from_object, const HandAngles& start,
                     const std::array<bool, kNumFingers>& fingers = kAllFingers,
                     double allowed_depth_m = kClosingDepth_m);

}  // namespace holdfast
