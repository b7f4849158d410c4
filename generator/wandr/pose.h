// SPDX-License-Identifier: MIT
#pragma once

#include <array>

#include <Eigen/Core>

#include "generator/wandr/heading.h"
#include "generator/wandr/rotation_6d.h"
#include "geometry/body/skeleton.h"

namespace holdfast::wandr {

/// Numbers of a state s = (body_transl 3 | body_orient 6 | body_pose 21 x 6), and of a delta.
inline constexpr int kStateSize = 3 + 6 * kNumBodyJoints;
/// Numbers of a state's tangent: (dp 3 | phi_0 .. phi_21, 3 each), rotations R Exp(phi).
inline constexpr int kTangentSize = 3 + 3 * kNumBodyJoints;

template <typename T>
using StateVector = Eigen::Matrix<T, kStateSize, 1>;
template <typename T>
using TangentVector = Eigen::Matrix<T, kTangentSize, 1>;
/// One state per column.
template <typename T>
using StateMatrix = Eigen::Matrix<T, kStateSize, Eigen::Dynamic>;

/// The state of one body in matrices: the pose of joints 0..21, world z up, metres. Fingers, jaw
/// and eyes are at rest.
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

/// Where joint k's three angles are in a tangent, and its six numbers in a state or delta.
inline constexpr int TangentOf(int joint) { return 3 + 3 * joint; }
inline constexpr int Rows12Of(int joint) { return 3 + 6 * joint; }

/// s of a pose: (p, rows12(R^0), .., rows12(R^21)).
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

/// The pose of a state; rows that are not orthonormal are made so by GS.
template <typename T>
Pose<T> PoseOf(const Eigen::Ref<const StateVector<T>>& state) {
  Pose<T> pose;
  pose.translation = state.template head<3>();
  for (int k = 0; k < kNumBodyJoints; ++k) {
    pose.rotation[k] = RotationFromRows12<T>(state.template segment<6>(Rows12Of(k)));
  }
  return pose;
}

}  // namespace holdfast::wandr
