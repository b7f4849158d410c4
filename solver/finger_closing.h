// SPDX-License-Identifier: MIT
#pragma once

#include <array>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/distance_grid.h"
#include "solver/hand_axes.h"
#include "solver/hand_evaluation.h"
#include "solver/hand_landmarks.h"

namespace holdfast {

/// What closing needs to know of a hand; all const and shared by threads.
struct HandAnatomy {
  explicit HandAnatomy(const HandModel& model) : hand(model), axes(model), landmarks(model, axes) {}

  const HandModel& hand;
  HandAxes axes;
  HandLandmarks landmarks;
};

/// An evaluation with the wrist at the origin, unrotated: world and wrist frame are the same.
HandEvaluation AtWrist(const HandModel& hand);

/// A flat hand, fingers nearly parallel and the thumb away from the palm.
HandAngles OpenHand(const HandAxes& axes);
/// The hand about to pinch something `width` metres thick: pads of the thumb and of the index and
/// middle finger face each other at that distance. Solved by least squares for this hand.
HandAngles PinchHand(const HandAnatomy& anatomy, double width);

struct ClosingOptions {
  double step = 0.035;            ///< radians a joint turns per step
  double touch_distance = 0.0006;  ///< metres: closer than this is contact
  double allowed_depth = 0.0015;   ///< metres: steps that end deeper are taken back
  std::array<bool, kNumFingers> fingers = {true, true, true, true, true};
};

struct Closing {
  HandAngles angles;
  std::array<bool, kNumHandParts> touching{};  ///< by part of the hand
  std::array<bool, kNumFingers> finger_touching{};
};

/// Closes finger by finger as a hand does that does not know what it meets: all joints of a finger
/// bend; where a phalanx touches, the joints before it stop and those behind go on, until the
/// fingertip touches, the ranges end, or another finger or the palm is in the way. Fingers that meet
/// nothing go back to the bend of a neighbour that does. `wrist_from_object` is held.
Closing CloseFingers(const HandAnatomy& anatomy, HandEvaluation& hand, const DistanceGrid& object,
                     const Eigen::Isometry3d& wrist_from_object, const HandAngles& start,
                     const ClosingOptions& options = {});

}  // namespace holdfast
