// SPDX-License-Identifier: MIT
#include "generator/body/pose_builder.h"

#include <algorithm>
#include <cmath>

#include "geometry/body/body_model.h"
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

namespace {

constexpr double kStraightest = 0.035;  // minimum elbow flexion, radians

double AngleOf(double upper, double lower, double distance) {
  const double cosine =
      (upper * upper + lower * lower - distance * distance) / (2.0 * upper * lower);
  return std::acos(std::clamp(cosine, -1.0, 1.0));
}

}  // namespace

double MoveWrist(const Eigen::Matrix3Xd& rest_joints, Side side, const Eigen::Matrix3d& rotation,
                 const Eigen::Vector3d& position, const Eigen::Vector3d& trans, JointPose& pose) {
  const int wrist = WristJoint(side);
  const int elbow = kJointParents[static_cast<std::size_t>(wrist)];
  const int shoulder = kJointParents[static_cast<std::size_t>(elbow)];
  const int collar = kJointParents[static_cast<std::size_t>(shoulder)];
  BodyState state;
  ForwardJoints(rest_joints, pose, trans, state);
  const auto world = [&](int joint) -> const Eigen::Matrix3d& {
    return state.world_rotation[static_cast<std::size_t>(joint)];
  };
  const Eigen::Vector3d root = state.joints.col(shoulder);
  const Eigen::Vector3d upper = state.joints.col(elbow) - root;
  const Eigen::Vector3d lower = state.joints.col(wrist) - state.joints.col(elbow);
  const double upper_length = upper.norm(), lower_length = lower.norm();

  // Angle at the elbow between the two bones, pi if straight.
  const double longest = std::sqrt(upper_length * upper_length + lower_length * lower_length +
                                   2.0 * upper_length * lower_length * std::cos(kStraightest));
  const double shortest = std::abs(upper_length - lower_length) + 0.02;
  const Eigen::Vector3d target = position - root;
  const double distance = std::clamp(target.norm(), shortest, longest);
  const double bend_now = AngleOf(upper_length, lower_length, (upper + lower).norm());
  const double bend = AngleOf(upper_length, lower_length, distance);
  Eigen::Vector3d axis = upper.cross(lower);
  if (axis.norm() < 1e-6 * upper_length * lower_length) {
    // A straight arm bends about the rest pose's vertical, rotated with the arm.
    axis = world(elbow) * Eigen::Vector3d(0.0, side == Side::kRight ? 1.0 : -1.0, 0.0);
  }
  const Eigen::Matrix3d bending =
      Eigen::AngleAxisd(bend_now - bend, axis.normalized()).toRotationMatrix();
  const Eigen::Vector3d reach = upper + bending * lower;
  const Eigen::Matrix3d swing = RotationBetween(reach, target).toRotationMatrix();

  const Eigen::Matrix3d shoulder_world = swing * world(shoulder);
  const Eigen::Matrix3d elbow_world = swing * bending * world(elbow);
  pose.col(shoulder) = LogSO3(world(collar).transpose() * shoulder_world);
  pose.col(elbow) = LogSO3(shoulder_world.transpose() * elbow_world);
  pose.col(wrist) = LogSO3(elbow_world.transpose() * rotation);
  return (root + swing * reach - position).norm();
}

}  // namespace holdfast
