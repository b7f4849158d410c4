// SPDX-License-Identifier: MIT
#include "generator/body/pose_builder.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Geometry>

#include "geometry/body/body_model.h"
#include "geometry/rotation.h"

namespace holdfast {

void PoseBuilder::SetFingers(Side side, const FingerPose& fingers) {
  for (int k = 0; k < kJointsPerHand; ++k) {
    SetLocal(HandBegin(side) + k, ExpSO3(fingers.segment<3>(3 * k)));
  }
}

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

namespace {

constexpr int kThumb = 4;

/// Degrees; fingers in skeleton order. Spread is away from the middle finger. `opposition` of the
/// thumb turns its pad to face the fingers.
struct HandShape {
  std::array<std::array<double, 3>, 5> flexion;
  std::array<double, 4> spread;
  double opposition;
};

constexpr HandShape kRelaxed = {
    {{{18, 26, 14}, {22, 30, 16}, {30, 34, 18}, {26, 33, 17}, {6, 12, 12}}}, {1, 0, 2, 1}, 12};
constexpr HandShape kOpen = {
    {{{8, 12, 6}, {8, 14, 8}, {12, 16, 8}, {10, 15, 8}, {-4, 4, 4}}}, {6, 0, 8, 3}, 24};
constexpr HandShape kClosed = {
    {{{46, 52, 28}, {50, 56, 32}, {56, 54, 32}, {53, 56, 32}, {14, 24, 26}}}, {1, 0, 1, 0}, 38};

HandShape Mix(const HandShape& a, const HandShape& b, double t) {
  HandShape mix;
  for (std::size_t f = 0; f < 5; ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      mix.flexion[f][k] = (1.0 - t) * a.flexion[f][k] + t * b.flexion[f][k];
    }
  }
  for (std::size_t f = 0; f < 4; ++f) mix.spread[f] = (1.0 - t) * a.spread[f] + t * b.spread[f];
  mix.opposition = (1.0 - t) * a.opposition + t * b.opposition;
  return mix;
}

FingerPose Pose(const Eigen::Matrix3Xd& rest_joints, Side side, const HandShape& shape) {
  const int begin = HandBegin(side);
  const Eigen::Vector3d palm = -Eigen::Vector3d::UnitY();
  const Eigen::Vector3d middle = rest_joints.col(begin + 3);
  FingerPose pose;
  for (int f = 0; f < 5; ++f) {
    for (int k = 0; k < 3; ++k) {
      const int joint = begin + 3 * f + k;
      const Eigen::Vector3d bone = k < 2 ? rest_joints.col(joint + 1) - rest_joints.col(joint)
                                         : rest_joints.col(joint) - rest_joints.col(joint - 1);
      // Flexion moves a fingertip towards the palm, and the thumb's towards a point under the
      // knuckle of the middle finger.
      const Eigen::Vector3d towards =
          f < kThumb ? palm : Eigen::Vector3d(middle + 0.035 * palm - rest_joints.col(joint));
      const Eigen::Vector3d axis = bone.cross(towards).normalized();
      Eigen::Matrix3d rotation = ExpSO3(shape.flexion[f][k] * kDegree * axis);
      if (k == 0 && f < kThumb) {
        const Eigen::Vector3d from_middle = rest_joints.col(joint) - middle;
        const double outward = from_middle.z() >= 0.0 ? 1.0 : -1.0;  // rest: z points to the thumb
        const Eigen::Vector3d spread_axis = bone.cross(outward * Eigen::Vector3d::UnitZ());
        if (f != 1) {
          rotation = ExpSO3(shape.spread[f] * kDegree * spread_axis.normalized()) * rotation;
        }
      } else if (k == 0) {
        // Opposition: the whole thumb rotates under the palm about the length of the hand.
        const Eigen::Vector3d length = (middle - rest_joints.col(WristJoint(side))).normalized();
        const double sign = side == Side::kRight ? 1.0 : -1.0;
        rotation = ExpSO3(-sign * shape.opposition * kDegree * length) * rotation;
      }
      pose.segment<3>(3 * (3 * f + k)) = LogSO3(rotation);
    }
  }
  return pose;
}

}  // namespace

FingerPose RelaxedFingers(const Eigen::Matrix3Xd& rest_joints, Side side) {
  return Pose(rest_joints, side, kRelaxed);
}

FingerPose GraspingFingers(const Eigen::Matrix3Xd& rest_joints, Side side, double closure) {
  return Pose(rest_joints, side, Mix(kOpen, kClosed, std::clamp(closure, 0.0, 1.0)));
}

}  // namespace holdfast
