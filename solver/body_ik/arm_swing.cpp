// SPDX-License-Identifier: MIT
#include "solver/body_ik/arm_swing.h"

#include <algorithm>
#include <cmath>

#include "generator/body/limb_ik.h"

namespace holdfast {

void SwingArms(const Eigen::Matrix3Xd& rest_joints, const std::array<double, 2>& idle, double walks,
               BodyFrame& frame) {
  using Eigen::Quaterniond;
  using Eigen::Vector3d;
  constexpr double kPerMetre = 1.35;  // radians of the upper arm for a metre between the ankles
  constexpr double kMost = 0.8;       // radians
  constexpr double kBend = 0.6;       // of the elbow, for a radian forward
  constexpr double kHangs = 0.6;      // of the way to an arm that hangs
  constexpr double kRestBend = 0.25;  // radians, of the elbow of such an arm
  const BodyPlacement placed = Place(rest_joints, frame);
  const double yaw = Yaw(frame);
  const Vector3d forward(std::sin(yaw), -std::cos(yaw), 0.0);
  const Vector3d to_left(std::cos(yaw), std::sin(yaw), 0.0);
  const double apart = forward.dot(placed.joints.col(kLeftAnkle) - placed.joints.col(kRightAnkle));
  for (const Side side : {Side::kLeft, Side::kRight}) {
    const bool left = side == Side::kLeft;
    const double share = idle[left ? 0 : 1];
    if (share <= 0.0) continue;
    const double ahead = walks * kMost * std::tanh(kPerMetre * (left ? -apart : apart) / kMost);
    const Limb arm = Arm(side);
    const Vector3d upper =
        (placed.joints.col(arm.middle) - placed.joints.col(arm.root)).normalized();
    const Vector3d hanging = Vector3d(-Vector3d::UnitZ() + (left ? 0.2 : -0.2) * to_left);
    const Quaterniond hangs =
        Quaterniond::Identity().slerp(share * kHangs, Quaterniond::FromTwoVectors(upper, hanging));
    // An arm that hangs goes forward about the axis to the right: forward x down.
    const Quaterniond swings(Eigen::AngleAxisd(share * ahead, Vector3d(-to_left)));
    const Quaterniond parent(placed.rotation[kJointParents[arm.root]]);
    frame.local[arm.root] =
        (parent.conjugate() * swings * hangs * parent * frame.local[arm.root]).normalized();
    const Quaterniond bent(Eigen::AngleAxisd(kRestBend + kBend * std::max(0.0, ahead), arm.hinge));
    frame.local[arm.middle] = frame.local[arm.middle].slerp(share * kHangs, bent);
  }
}

}  // namespace holdfast
