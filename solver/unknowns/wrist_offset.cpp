// SPDX-License-Identifier: MIT
#include "solver/unknowns/wrist_offset.h"

#include "generator/body/pose_builder.h"

namespace holdfast {
namespace {

Eigen::Isometry3d WristOf(const HandModel& hand, const Eigen::Vector3d& trans,
                          const JointPose& pose) {
  BodyState state;
  ForwardJoints(hand.Surface().RestJoints(), pose, trans, state);
  return state.WorldFromJoint(WristJoint(hand.HandSide()));
}

}  // namespace

double MoveHand(const HandModel& hand, const WristOffset& offset, Eigen::Ref<Eigen::Vector3d> trans,
                JointPose& pose) {
  if (offset.IsZero()) return 0.0;
  const Eigen::Isometry3d wrist = WristOf(hand, trans, pose);
  const Eigen::Matrix3d rotation = wrist.linear() * offset.rotation.toRotationMatrix();
  const Eigen::Vector3d position = wrist * offset.translation;
  if (hand.Surface().Model().LoneHand()) {
    // Root and wrist coincide: the wrist moves with the root.
    const Eigen::Matrix3d root_from_wrist = wrist.linear().transpose() * ExpSO3(pose.col(0));
    pose.col(0) = LogSO3(rotation * root_from_wrist);
    trans += position - wrist.translation();
    return 0.0;
  }
  return MoveWrist(hand.Surface().RestJoints(), hand.HandSide(), rotation, position, trans, pose);
}

WristOffset OffsetTo(const HandModel& hand, const Eigen::Isometry3d& wrist,
                     const Eigen::Vector3d& trans, const JointPose& pose) {
  const Eigen::Isometry3d difference = WristOf(hand, trans, pose).inverse() * wrist;
  return {Eigen::Quaterniond(difference.linear()).normalized(), difference.translation()};
}

}  // namespace holdfast
