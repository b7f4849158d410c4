// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include <Eigen/Core>

#include "generator/wandr/pose.h"

namespace holdfast::wandr {

/// What a motion that is left to itself on its way to a goal is judged by.
struct GoalLossWeights {
  float distance = 1.0f;   ///< per meter between wrist and goal about the deadline
  float skating = 0.02f;   ///< the lowest foot joint slides, in units of 4 mm a frame
  float floor = 0.02f;     ///< foot joints below the ground they are to stand on, units of 2 cm
  float airborne = 0.02f;  ///< both feet far above it, units of 2 cm
  float speed = 0.05f;     ///< pelvis faster than 1.6 m/s, units of 0.5 m/s
};

/// Heights of foot joints (ankles and balls) of somebody who stands, meters: from the body's rest.
struct FootHeights {
  float ankle = 0.0f;
  float ball = 0.0f;
};

/// Loss of one motion (joints of frames 0..T), with its gradient times `scale` added to `bars`:
/// the distance is a soft minimum over the frames from 20 before the deadline on (weights
/// softmax(-d^2 / (0.2 m)^2), taken as constant) of sqrt(d^2 + (3 cm)^2); the rest are means over
/// frames of squares. Returns the loss, not scaled.
double AddGoalLoss(std::span<const BodyJoints<float>> joints, const Eigen::Vector3f& goal,
                   int deadline, int wrist_joint, const FootHeights& standing,
                   const GoalLossWeights& weights, float scale, std::span<BodyJoints<float>> bars);

}  // namespace holdfast::wandr
