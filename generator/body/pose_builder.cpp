// SPDX-License-Identifier: MIT
#include "generator/body/pose_builder.h"

#include "geometry/rotation.h"

namespace holdfast {

Eigen::Matrix3d PoseBuilder::World(int joint) const {
  Eigen::Matrix3d rotation = local_[joint];
  for (int j = kJointParents[joint]; j >= 0; j = kJointParents[j]) rotation = local_[j] * rotation;
  return rotation;
}

Eigen::Vector3d PoseBuilder::Position(int joint) const {
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  for (int j = joint; j > 0; j = kJointParents[j]) {
    const int parent = kJointParents[j];
    offset = local_[parent] * (rest_joints_.col(j) - rest_joints_.col(parent) + offset);
  }
  return pelvis_ + offset;
}

JointPose PoseBuilder::Pose(const JointPose& previous) const {
  JointPose pose;
  for (int j = 0; j < kNumJoints; ++j) {
    pose.col(j) = UnwrapAxisAngle(LogSO3(local_[j]), previous.col(j));
  }
  return pose;
}

}  // namespace holdfast
