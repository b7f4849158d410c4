// SPDX-License-Identifier: MIT
#pragma once

#include <array>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/body_model.h"

namespace holdfast {

/// Changes to one arm in one frame: collar, shoulder, elbow, wrist, three each. Rotations
/// R_j = S_j exp(x_j) with S_j the clip's, radians.
using ArmChange = Eigen::Matrix<double, 12, 1>;
using J_point_arm = Eigen::Matrix<double, 3, 12>;

/// Joints of an arm, from the inside out.
enum ArmJoint : int { kArmCollar, kArmShoulder, kArmElbow, kArmWrist };
/// The joint in SMPL-X's numbering.
inline constexpr int JointOfArm(Side side, int joint) {
  constexpr int kRight[] = {kRightCollar, kRightShoulder, kRightElbow, kRightWrist};
  return kRight[joint] - (side == Side::kLeft ? 1 : 0);
}

/// One frame's arm as the clip has it.
struct ArmFrame {
  std::array<Eigen::Matrix3d, 4> local;  ///< S_j
  std::array<Eigen::Vector3d, 4> bone;   ///< from the joint before, in its frame, metres
  Eigen::Isometry3d chest;               ///< world pose of the collar's parent

  /// `state` has the joints of the frame (ForwardJoints).
  ArmFrame(const Eigen::Matrix3Xd& rest_joints, Side side, const BodyState& state);
};

/// The arm with a change made, and how it moves with that. Scratch.
class ArmState {
 public:
  void Evaluate(const ArmFrame& frame, const ArmChange& change);

  const Eigen::Isometry3d& WorldFrom(int joint) const { return world_[joint]; }
  /// d (world position `point` of something fixed to `joint`) / d change.
  J_point_arm PointJacobian(int joint, const Eigen::Vector3d& point) const;
  /// The world rotation vector of `joint` per change: d R = [J dx]x R.
  J_point_arm TurnJacobian(int joint) const;

 private:
  std::array<Eigen::Isometry3d, 4> world_;
  std::array<Eigen::Matrix3d, 4> J_omega_;
};

}  // namespace holdfast
