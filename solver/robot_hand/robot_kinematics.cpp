// SPDX-License-Identifier: MIT
#include "solver/robot_hand/robot_kinematics.h"

#include <cassert>

namespace holdfast {

RobotState::RobotState(const RobotHand& hand)
    : hand_(&hand),
      root_from_link_(hand.links.size(), Eigen::Isometry3d::Identity()),
      chains_(hand.links.size()),
      columns_(hand.links.size()) {
  for (std::size_t k = 0; k < hand.links.size(); ++k) {
    const RobotLink& link = hand.links[k];
    assert(link.parent < static_cast<int>(k));
    if (link.parent >= 0) chains_[k] = chains_[static_cast<std::size_t>(link.parent)];
    columns_[k].dof = link.dof;
    if (link.dof >= 0) chains_[k].push_back(static_cast<int>(k));
  }
}

void RobotState::Evaluate(const Eigen::Ref<const Eigen::VectorXd>& q) {
  assert(q.size() == hand_->NumDofs());
  for (std::size_t k = 0; k < hand_->links.size(); ++k) {
    const RobotLink& link = hand_->links[k];
    Eigen::Isometry3d& pose = root_from_link_[k];
    pose = link.parent < 0
               ? link.parent_from_joint
               : root_from_link_[static_cast<std::size_t>(link.parent)] * link.parent_from_joint;
    const double value = link.offset + (link.dof < 0 ? 0.0 : link.factor * q(link.dof));
    const Eigen::Vector3d axis = pose.linear() * link.axis;
    if (link.dof >= 0) {
      auto& twist = columns_[k].twist;
      const bool turns = link.kind == RobotJointKind::kTurning;
      twist.head<3>() = turns ? Eigen::Vector3d(link.factor * axis) : Eigen::Vector3d::Zero();
      twist.tail<3>() = turns ? Eigen::Vector3d(link.factor * pose.translation().cross(axis))
                              : Eigen::Vector3d(link.factor * axis);
    }
    if (value == 0.0) continue;
    if (link.kind == RobotJointKind::kSliding) {
      pose.translation() += value * axis;
    } else {
      pose.linear() = pose.linear() * Eigen::AngleAxisd(value, link.axis).toRotationMatrix();
    }
  }
}

Eigen::Matrix3Xd RobotState::PointJacobian(int link, const Eigen::Vector3d& point) const {
  Eigen::Matrix3Xd J = Eigen::Matrix3Xd::Zero(3, hand_->NumDofs());
  for (const int joint : Chain(link)) {
    const Column& column = ColumnOf(joint);
    J.col(column.dof) += column.twist.head<3>().cross(point) + column.twist.tail<3>();
  }
  return J;
}

}  // namespace holdfast
