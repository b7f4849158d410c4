// SPDX-License-Identifier: MIT
#pragma once

#include <array>

#include <Eigen/Core>

#include "generator/wandr/intention.h"
#include "generator/wandr/rotation_6d.h"
#include "geometry/body/skeleton.h"

namespace holdfast::wandr {

/// Size of a state s = (body_transl 3 | body_orient 6 | body_pose 21 x 6), and of a delta.
inline constexpr int kStateSize = 3 + 6 * kNumBodyJoints;
/// Size of a state's tangent: (dp 3 | phi_0 .. phi_21, 3 each), rotations R Exp(phi).
inline constexpr int kTangentSize = 3 + 3 * kNumBodyJoints;

template <typename T>
using StateVector = Eigen::Matrix<T, kStateSize, 1>;
template <typename T>
using TangentVector = Eigen::Matrix<T, kTangentSize, 1>;
/// One state per column.
template <typename T>
using StateMatrix = Eigen::Matrix<T, kStateSize, Eigen::Dynamic>;

/// State of one body as matrices: the pose of joints 0..21, world z up, meters. Fingers, jaw and
/// eyes are at rest.
template <typename T>
struct Pose {
  Vector3<T> translation = Vector3<T>::Zero();  ///< p, SMPL-X `transl`: the pelvis is at p + J_0
  std::array<Matrix3<T>, kNumBodyJoints> rotation = Identities();  ///< R^0 to world, R^k to parent

  template <typename U>
  Pose<U> Cast() const {
    Pose<U> out;
    out.translation = translation.template cast<U>();
    for (int k = 0; k < kNumBodyJoints; ++k) out.rotation[k] = rotation[k].template cast<U>();
    return out;
  }

 private:
  static std::array<Matrix3<T>, kNumBodyJoints> Identities() {
    std::array<Matrix3<T>, kNumBodyJoints> all;
    all.fill(Matrix3<T>::Identity());
    return all;
  }
};

/// Offset of joint k's three angles in a tangent, and of its six numbers in a state or delta.
inline constexpr int TangentOf(int joint) { return 3 + 3 * joint; }
inline constexpr int Rows12Of(int joint) { return 3 + 6 * joint; }

/// State of a pose: (p, rows12(R^0), .., rows12(R^21)).
template <typename T>
void WriteState(const Pose<T>& pose, Eigen::Ref<StateVector<T>> state) {
  state.template head<3>() = pose.translation;
  for (int k = 0; k < kNumBodyJoints; ++k) {
    state.template segment<6>(Rows12Of(k)) = Rows12<T>(pose.rotation[k]);
  }
}

template <typename T>
StateVector<T> StateOf(const Pose<T>& pose) {
  StateVector<T> state;
  WriteState<T>(pose, state);
  return state;
}

/// Pose of a state. Rows that are not orthonormal are orthonormalized by GS.
template <typename T>
Pose<T> PoseOf(const Eigen::Ref<const StateVector<T>>& state) {
  Pose<T> pose;
  pose.translation = state.template head<3>();
  for (int k = 0; k < kNumBodyJoints; ++k) {
    pose.rotation[k] = RotationFromRows12<T>(state.template segment<6>(Rows12Of(k)));
  }
  return pose;
}

/// A delta d = (dp 3 | six_0 .. six_21) maps a pose to the next one, 1/30 s later:
///   p' = p + Z dp,  R^k' = R^k GS(six_k),
/// so dp is in meters per frame in the heading frame of the first pose, and rotations are
/// body-frame changes. Deltas here are not normalized; those of networks are (statistics.h).

/// Delta between two poses: dp = Z^T (p' - p), six_k = rows12(R^k^T R^k').
template <typename T>
StateVector<T> DeltaBetween(const Pose<T>& from, const Pose<T>& to) {
  StateVector<T> delta;
  delta.template head<3>() =
      HeadingOf<T>(from.rotation[0]).FromWorld(to.translation - from.translation);
  for (int k = 0; k < kNumBodyJoints; ++k) {
    const Matrix3<T> change = from.rotation[k].transpose() * to.rotation[k];
    delta.template segment<6>(Rows12Of(k)) = Rows12<T>(change);
  }
  return delta;
}

/// Delta of a body at rest: zero translation, identity rotations.
template <typename T>
StateVector<T> RestDelta() {
  return DeltaBetween(Pose<T>{}, Pose<T>{});
}

/// s' = step(s, d). Rotations are orthonormalized at every step, so that rounding errors do not
/// accumulate over a rollout. `next` may be `pose`.
template <typename T>
void ApplyDelta(const Pose<T>& pose, const Heading<T>& heading,
                const Eigen::Ref<const StateVector<T>>& delta, Pose<T>& next) {
  next.translation = pose.translation + heading.ToWorld(delta.template head<3>());
  for (int k = 0; k < kNumBodyJoints; ++k) {
    const Matrix3<T> change = RotationFromRows12<T>(delta.template segment<6>(Rows12Of(k)));
    const Matrix3<T> product = pose.rotation[k] * change;
    next.rotation[k] = Orthonormalized<T>(product);
  }
}

/// Maps the gradient `next_bar` of s' to those of s (added to `pose_bar`) and of d (written):
///   p_bar += p'_bar,  phi_0_bar += g_a (Z (e_z x dp)) . p'_bar,  phi_k_bar += D_k phi_k'_bar,
///   dp_bar = Z^T p'_bar,  six_k_bar = J_GS(six_k)^T phi_k'_bar.
template <typename T>
void ApplyDeltaVjp(const Heading<T>& heading, const Eigen::Ref<const StateVector<T>>& delta,
                   const Eigen::Ref<const TangentVector<T>>& next_bar,
                   Eigen::Ref<TangentVector<T>> pose_bar, Eigen::Ref<StateVector<T>> delta_bar) {
  const Vector3<T> p_bar = next_bar.template head<3>();
  const Vector3<T> local_bar = heading.FromWorld(p_bar);
  pose_bar.template head<3>() += p_bar;
  const T turn_bar = delta[0] * local_bar.y() - delta[1] * local_bar.x();
  pose_bar.template segment<3>(TangentOf(0)) += turn_bar * heading.gradient;
  delta_bar.template head<3>() = local_bar;
  for (int k = 0; k < kNumBodyJoints; ++k) {
    const Vector6<T> six = delta.template segment<6>(Rows12Of(k));
    const Vector3<T> phi_bar = next_bar.template segment<3>(TangentOf(k));
    pose_bar.template segment<3>(TangentOf(k)) += RotationFromRows12<T>(six) * phi_bar;
    delta_bar.template segment<6>(Rows12Of(k)) = RotationFromRows12Vjp<T>(six, phi_bar);
  }
}

/// Positions of joints 0..21, one per column, meters; 66 numbers as one column of a batch.
template <typename T>
using BodyJoints = Eigen::Matrix<T, 3, kNumBodyJoints>;
inline constexpr int kJointNumbers = 3 * kNumBodyJoints;

/// Bones of one person: o_k = J_k - J_parent(k), o_0 = J_0, from rest joints J.
template <typename T>
struct BoneOffsets {
  BodyJoints<T> offset;

  template <typename U>
  BoneOffsets<U> Cast() const {
    return {offset.template cast<U>()};
  }
};

/// `rest_joints` (3 x 22 or more), as returned by BodyModel::RestJoints().
inline BoneOffsets<double> BoneOffsetsOf(const Eigen::Ref<const Eigen::Matrix3Xd>& rest_joints) {
  BoneOffsets<double> bones;
  for (int k = 0; k < kNumBodyJoints; ++k) {
    bones.offset.col(k) = rest_joints.col(k);
    if (k > 0) bones.offset.col(k) -= rest_joints.col(kJointParents[k]);
  }
  return bones;
}

/// A_k, joint frame to world, and q_k, world joint positions:
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

/// q_wrist only, from the joints that move it: arm, spine and root.
template <typename T>
Vector3<T> WristPosition(const BoneOffsets<T>& bones, const Pose<T>& pose, Side side) {
  // From the wrist up: a point x in the frame of joint k is o_k + R^k x in the parent frame.
  int joint = WristJoint(side);
  Vector3<T> point = bones.offset.col(joint);
  for (joint = kJointParents[joint]; joint > 0; joint = kJointParents[joint]) {
    point = bones.offset.col(joint) + pose.rotation[joint] * point;
  }
  return pose.translation + bones.offset.col(0) + pose.rotation[0] * point;
}

/// Adds to `tangent_bar` the gradient for `joints_bar`, the gradient with respect to q:
///   p_bar = sum_j q_bar_j,  phi_bar_k = A_k^T sum_{j below k} (q_j - q_k) x q_bar_j.
template <typename T>
void ForwardKinematicsVjp(const BodyKinematics<T>& at,
                          const Eigen::Ref<const BodyJoints<T>>& joints_bar,
                          Eigen::Ref<TangentVector<T>> tangent_bar) {
  // Forces and their moments about the pelvis, accumulated from the leaves to the root.
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
