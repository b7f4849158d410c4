// SPDX-License-Identifier: MIT
#pragma once

#include <array>

#include <Eigen/Core>

#include "geometry/body/skeleton.h"

namespace holdfast {

/// Joints of the default body at rest: T-pose, palms down, y up, facing +z, metres; an adult of
/// 1.66 m. Left and right mirror each other exactly at x = 0. All is made with the pelvis at the
/// origin; the file has it at kEmbeddedRestPelvis.
using RestJoints = Eigen::Matrix<double, 3, kNumJoints>;
RestJoints DefaultRestJoints();

/// Height of the sole in the rest pose, metres (negative: the pelvis joint is near y = 0).
inline constexpr double kSoleY = -0.878;

/// The five fingers in SMPL-X order within a hand.
enum Finger { kIndex, kMiddle, kPinky, kRing, kThumb, kNumFingers };

/// Joints of one finger of the left hand, base to last, then the finger's tip (not a joint).
struct FingerChain {
  std::array<int, 3> joints;
  std::array<Eigen::Vector3d, 4> points;
};
FingerChain LeftFingerChain(Finger finger);

}  // namespace holdfast
