// SPDX-License-Identifier: MIT
#include "solver/body_ik/arm_swing.h"

#include <algorithm>
#include <cmath>

#include "generator/body/limb_ik.h"

namespace holdfast {

void SwingArms(const Eigen::Matrix3Xd& rest_joints, const std::array<double, 2>& shares,
               BodyFrame& frame) {
  constexpr double kPerMetre = 0.55;  // radians of the upper arm for a metre between the ankles
  constexpr double kMost = 0.45;      // radians
  constexpr double kBend = 0.6;       // of the elbow, for a radian forward
  const BodyPlacement placed = Place(rest_joints, frame);
  const double yaw = Yaw(frame);
  const Eigen::Vector3d forward(std::sin(yaw), -std::cos(yaw), 0.0);
  const Eigen::Vector3d to_left(std::cos(yaw), std::sin(yaw), 0.0);
  const double apart = forward.dot(placed.joints.col(kLeftAnkle) - placed.joints.col(kRightAnkle));
  for (const Side side : {Side::kLeft, Side::kRight}) {
    const bool left = side == Side::kLeft;
    const double share = shares[left ? 0 : 1];
    const double ahead = kMost * std::tanh(kPerMetre * (left ? -apart : apart) / kMost);
    if (share <= 0.0) continue;
    const Limb arm = Arm(side);
    // An arm that hangs goes forward about the axis to the right: forward x down.
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(share * ahead, Eigen::Vector3d(-to_left)).toRotationMatrix();
    const Eigen::Matrix3d& parent = placed.rotation[kJointParents[arm.root]];
    frame.local[arm.root] =
        (Eigen::Quaterniond(Eigen::Matrix3d(parent.transpose() * turn * parent)) *
         frame.local[arm.root])
            .normalized();
    const double bend = share * kBend * std::max(0.0, ahead);
    frame.local[arm.middle] =
        (frame.local[arm.middle] * Eigen::Quaterniond(Eigen::AngleAxisd(bend, arm.hinge)))
            .normalized();
  }
}

}  // namespace holdfast
