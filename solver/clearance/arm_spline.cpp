// SPDX-License-Identifier: MIT
#include "solver/clearance/arm_spline.h"

#include "geometry/rotation.h"

namespace holdfast {

ArmFrame::ArmFrame(const Eigen::Matrix3Xd& rest_joints, Side side, const BodyState& state) {
  const int parent = kJointParents[JointOfArm(side, kArmCollar)];
  chest = state.WorldFromJoint(parent);
  for (int k = 0, before = parent; k < 4; ++k) {
    const int joint = JointOfArm(side, k);
    local[k] = state.local_rotation[joint];
    bone[k] = rest_joints.col(joint) - rest_joints.col(before);
    before = joint;
  }
}

void ArmState::Evaluate(const ArmFrame& frame, const ArmChange& change) {
  Eigen::Isometry3d world = frame.chest;
  for (int k = 0; k < 4; ++k) {
    const Eigen::Vector3d x = change.segment<3>(3 * k);
    world.translation() = world * frame.bone[k];
    world.linear() = world.linear() * frame.local[k] * ExpSO3(x);
    world_[k] = world;
    // exp(x + dx) = exp(x) exp(Jr(x) dx), and Jr(x) = Jl(-x).
    J_omega_[k] = world.linear() * LeftJacobianSO3(-x);
  }
}

J_point_arm ArmState::PointJacobian(int joint, const Eigen::Vector3d& point) const {
  J_point_arm J = J_point_arm::Zero();
  for (int k = 0; k <= joint; ++k) {
    J.middleCols<3>(3 * k) =
        -Skew<double>(point - Eigen::Vector3d(world_[k].translation())) * J_omega_[k];
  }
  return J;
}

J_point_arm ArmState::TurnJacobian(int joint) const {
  J_point_arm J = J_point_arm::Zero();
  for (int k = 0; k <= joint; ++k) J.middleCols<3>(3 * k) = J_omega_[k];
  return J;
}

}  // namespace holdfast
