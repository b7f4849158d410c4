// SPDX-License-Identifier: MIT
#pragma once

#include <array>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/mesh/distance_grid.h"
#include "solver/hand/hand_postures.h"

namespace holdfast {

struct ClosingOptions {
  double step = 0.035;             ///< radians a joint turns per step near the object, more far off
  double touch_distance = 0.0006;  ///< meters: closer than this is contact
  double allowed_depth = 0.0015;   ///< meters: steps that end deeper are taken back
  std::array<bool, kNumFingers> fingers = {true, true, true, true, true};
};

struct Closing {
  HandAngles angles;
  std::array<bool, kNumHandParts> touching{};  ///< by part of the hand
  std::array<bool, kNumFingers> finger_touching{};
};

/// Closes finger by finger as a hand does that does not know what it meets: all joints of a finger
/// bend; where a phalanx touches, the joints before it stop and those behind go on, until the
/// fingertip touches, the ranges end, or another finger or the palm is in the way. Fingers that
/// meet nothing go back to the bend of a neighbor that does. `wrist_from_object` is held.
Closing CloseFingers(const HandAnatomy& anatomy, HandEvaluation& hand, const DistanceGrid& object,
                     const Eigen::Isometry3d& wrist_from_object, const HandAngles& start,
                     const ClosingOptions& options = {});

}  // namespace holdfast
