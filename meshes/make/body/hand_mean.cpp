// SPDX-License-Identifier: MIT
#include "meshes/make/body/hand_mean.h"

#include <numbers>

#include <Eigen/Geometry>

namespace holdfast {

using Eigen::Vector3d;

Vector3d LeftDorsalDirection(Finger finger) {
  return finger == kThumb ? Vector3d(-0.35, 0.62, 0.70).normalized() : Vector3d::UnitY();
}

Vector3d LeftFlexionAxis(Finger finger, int k) {
  const FingerChain chain = LeftFingerChain(finger);
  const Vector3d bone = chain.points[k + 1] - chain.points[k];
  return bone.cross(-LeftDorsalDirection(finger)).normalized();
}

std::array<double, kHandDofs> RelaxedHand(Side side) {
  constexpr std::array<std::array<double, 3>, kNumFingers> kFlexionDegrees = {
      {{20, 28, 14}, {25, 32, 16}, {32, 34, 18}, {29, 34, 18}, {8, 10, 14}}};
  std::array<double, kHandDofs> pose{};
  for (int f = 0; f < kNumFingers; ++f) {
    for (int k = 0; k < 3; ++k) {
      Vector3d w = LeftFlexionAxis(static_cast<Finger>(f), k) * kFlexionDegrees[f][k] *
                   std::numbers::pi / 180.0;
      if (side == Side::kRight) w = Vector3d(w.x(), -w.y(), -w.z());
      for (int axis = 0; axis < 3; ++axis) pose[9 * f + 3 * k + axis] = w[axis];
    }
  }
  return pose;
}

}  // namespace holdfast
