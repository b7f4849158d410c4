// SPDX-License-Identifier: MIT
#pragma once

#include "solver/hand/hand_axes.h"
#include "solver/hand/hand_evaluation.h"
#include "solver/hand/hand_landmarks.h"

namespace holdfast {

/// Anatomy of a hand for grasping; const and shared by threads. `model` must outlive it.
struct HandAnatomy {
  explicit HandAnatomy(const HandModel& model) : hand(model), axes(model), landmarks(model, axes) {}

  const HandModel& hand;
  HandAxes axes;
  HandLandmarks landmarks;
};

/// An evaluation with the wrist at the origin, unrotated: world and wrist frame are the same.
HandEvaluation AtWrist(const HandModel& hand);

/// An open hand, fingers nearly parallel and the thumb away from the palm.
HandAngles OpenHand(const HandAxes& axes);
/// A hand about to pinch an object `width` meters thick: pads of the thumb and of the index and
/// middle finger face each other at that distance. Solved by least squares for this hand.
HandAngles PinchHand(const HandAnatomy& anatomy, double width);

}  // namespace holdfast
