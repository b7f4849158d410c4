// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <span>

#include <Eigen/Core>

#include "generator/wandr/pose.h"
#include "geometry/body/skeleton.h"

namespace holdfast::wandr {

/// Positions of joints 0..21, one per column, metres; as one column of a batch, 66 numbers.
template <typename T>
using BodyJoints = Eigen::Matrix<T, 3, kNumBodyJoints>;
inline constexpr int kJointNumbers = 3 * kNumBodyJoints;

/// The bones of one person: o_k = J_k - J_parent(k), o_0 = J_0, from rest joints J.
template <typename T>
struct BoneOffsets {
  BodyJoints<T> offset;

  template <typename U>
  BoneOffsets<U> Cast() const {
    return {offset.template cast<U>()};
  }
};

/// `rest_joints` (3 x 22 or more), as BodyModel::RestJoints() gives them.
inline BoneOffsets<double> BoneOffsetsOf(const Eigen::Ref<const Eigen::Matrix3Xd>& rest_joints) {
  BoneOffsets<double> bones;
  for (int k = 0; k < kNumBodyJoints; ++k) {
    bones.offset.col(k) = rest_joints.col(k);
    if (k > 0) bones.offset.col(k) -= rest_joints.col(kJointParents[k]);
  }
  return bones;
}

/// A_k, joint frames to world, and q_k, joints in the world:
///   A_0 = R^0, q_0 = p + J_0,  A_k = A_parent R^k, q_k = q_parent + A_parent o_k.
template <typename T>
struct BodyKinematics {
  std::array<Matrix3<T>, kNumBodyJoints> world;
  BodyJoints<T> joints;
};

template <typename T>
void ForwardKinematics(const BoneOffsets<T>& bones, const Pose<T>& pose, BodyKinematics<T>& out) {
  out.world[0] = pose.rotation[0];
  out.joints.col(0) = pose.translation + bones.offset.col(0);
  for (int k = 1; k < kNumBodyJoints; ++k) {
    const int parent = kJointParents[k];
    out.world[k].noalias() = out.world[parent] * pose.rotation[k];
    out.joints.col(k) = out.joints.col(parent) + out.world[parent] * bones.offset.col(k);
  }
}

/// Joints of a batch: column i of `joints` (66 x N) is pose i's.
template <typename T>
void ForwardKinematics(const BoneOffsets<T>& bones, std::span<const Pose<T>> poses,
                       Eigen::Ref<Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic>> joints) {
  BodyKinematics<T> kinematics;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    ForwardKinematics(bones, poses[i], kinematics);
    Eigen::Map<BodyJoints<T>>(joints.col(i).data()) = kinematics.joints;
  }
}

/// q_wrist alone, by the joints that move it: the arm's, the spine's and the root.
template <typename T>
Vector3<T> WristPosition(const BoneOffsets<T>& bones, const Pose<T>& pose, Side side) {
  // From the wrist up: a point in joint k's frame is o_k + R^k x in that of its parent.
  int joint = WristJoint(side);
  Vector3<T> point = bones.offset.col(joint);
  for (joint = kJointParents[joint]; joint > 0; joint = kJointParents[joint]) {
    point = bones.offset.col(joint) + pose.rotation[joint] * point;
  }
  return pose.translation + bones.offset.col(0) + pose.rotation[0] * point;
}

/// Adds to `tangent_bar` the gradient of what has `joints_bar` with respect to q:
///   p_bar = sum_j q_bar_j,  phi_bar_k = A_k^T sum_{j below k} (q_j - q_k) x q_bar_j.
template <typename T>
void ForwardKinematicsVjp(const BodyKinematics<T>& at,
                          const Eigen::Ref<const BodyJoints<T>>& joints_bar,
                          Eigen::Ref<TangentVector<T>> tangent_bar) {
  // Forces and their moments about the pelvis, gathered from the leaves inwards.
  BodyJoints<T> force = joints_bar, moment;
  for (int k = 0; k < kNumBodyJoints; ++k) {
    const Vector3<T> arm = at.joints.col(k) - at.joints.col(0);
    moment.col(k) = arm.cross(Vector3<T>(force.col(k)));
  }
  for (int k = kNumBodyJoints - 1; k >= 0; --k) {
    const Vector3<T> arm = at.joints.col(k) - at.joints.col(0);
    const Vector3<T> about_joint = moment.col(k) - arm.cross(Vector3<T>(force.col(k)));
    tangent_bar.template segment<3>(TangentOf(k)) += at.world[k].transpose() * about_joint;
    if (k == 0) break;
    force.col(kJointParents[k]) += force.col(k);
    moment.col(kJointParents[k]) += moment.col(k);
  }
  tangent_bar.template head<3>() += force.col(0);
}

}  // namespace holdfast::wandr
