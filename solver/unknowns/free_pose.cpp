// SPDX-License-Identifier: MIT
#include "solver/unknowns/free_pose.h"

#include "geometry/rotation.h"

namespace holdfast {

FreePose::FreePose(const JointPose& rest, std::vector<int> joints, std::vector<Hand> hands)
    : rest_(rest), joints_(std::move(joints)), hands_(std::move(hands)) {
  column_.fill(-1);
  for (const int joint : joints_) {
    column_[static_cast<std::size_t>(joint)] = size_;
    size_ += 3;
  }
  for (Hand& hand : hands_) {
    hand.column = size_;
    size_ += static_cast<int>(hand.synergies.cols());
  }
}

std::vector<FreePose::Part> FreePose::Parts() const {
  std::vector<Part> parts;
  for (const int joint : joints_) parts.push_back({Column(joint), 3});
  for (const Hand& hand : hands_) {
    parts.push_back({hand.column, static_cast<int>(hand.synergies.cols())});
  }
  return parts;
}

JointPose FreePose::Pose(const double* root, const double* q) const {
  JointPose pose = rest_;
  pose.col(0) = Eigen::Map<const Eigen::Vector3d>(root + 3);
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    pose.col(joints_[k]) = Eigen::Map<const Eigen::Vector3d>(q + 3 * k);
  }
  for (const Hand& hand : hands_) {
    const Eigen::Map<const Eigen::VectorXd> h(q + hand.column, hand.synergies.cols());
    Eigen::Map<Eigen::VectorXd>(pose.col(HandBegin(hand.side)).data(), kHandDofs) +=
        hand.synergies * h;
  }
  return pose;
}

Eigen::VectorXd FreePose::Of(const JointPose& pose) const {
  Eigen::VectorXd q = Eigen::VectorXd::Zero(size_);
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    q.segment<3>(3 * static_cast<Eigen::Index>(k)) = pose.col(joints_[k]);
  }
  return q;
}

void FreePoseState::Evaluate(const FreePose& free, const Eigen::Matrix3Xd& rest_joints,
                             const double* root, const double* q, bool with_jacobian) {
  free_ = &free;
  ForwardJoints(rest_joints, free.Pose(root, q), Eigen::Map<const Eigen::Vector3d>(root), body_);
  if (!with_jacobian) return;
  root_turn_ = LeftJacobianSO3(body_.pose.col(0));
  const auto turn = [&](int joint) {
    turn_[joint] =
        body_.world_rotation[kJointParents[joint]] * LeftJacobianSO3(body_.pose.col(joint));
  };
  for (const int joint : free.Joints()) turn(joint);
  for (const FreePose::Hand& hand : free.Hands()) {
    for (int k = 0; k < kJointsPerHand; ++k) turn(HandBegin(hand.side) + k);
  }
}

Eigen::Matrix<double, 3, 6> FreePoseState::RootJacobian(const Eigen::Vector3d& world) const {
  Eigen::Matrix<double, 3, 6> J;
  J.leftCols<3>().setIdentity();
  J.rightCols<3>() = -Skew<double>(world - body_.joints.col(0)) * root_turn_;
  return J;
}

void FreePoseState::AddPoseJacobian(int joint, const Eigen::Vector3d& world,
                                    const Eigen::Matrix3d& weight, Eigen::Ref<RowMajor> J) const {
  for (int a = joint; a > 0; a = kJointParents[a]) {
    if (const int column = free_->Column(a); column >= 0) {
      J.middleCols<3>(column) -= weight * Skew<double>(world - body_.joints.col(a)) * turn_[a];
      continue;
    }
    for (const FreePose::Hand& hand : free_->Hands()) {
      const int finger_joint = a - HandBegin(hand.side);
      if (finger_joint < 0 || finger_joint >= kJointsPerHand) continue;
      const Eigen::Matrix3d J_angle =
          -weight * Skew<double>(world - body_.joints.col(a)) * turn_[a];
      J.middleCols(hand.column, hand.synergies.cols()).noalias() +=
          J_angle * hand.synergies.middleRows<3>(3 * finger_joint);
    }
  }
}

Eigen::Matrix<double, 3, Eigen::Dynamic> FreePoseState::ShapeJacobian(
    int joint, const Eigen::MatrixXd& J_rest) const {
  Eigen::Matrix<double, 3, Eigen::Dynamic> J = J_rest.topRows<3>();
  for (int a = joint; a > 0; a = kJointParents[a]) {
    J.noalias() += body_.world_rotation[kJointParents[a]] *
                   (J_rest.middleRows<3>(3 * a) - J_rest.middleRows<3>(3 * kJointParents[a]));
  }
  return J;
}

}  // namespace holdfast
