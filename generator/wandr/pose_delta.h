// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "generator/wandr/heading.h"
#include "generator/wandr/pose.h"

namespace holdfast::wandr {

/// A delta d = (dp 3 | six_0 .. six_21) carries one pose to the next, 1/30 s later:
///   p' = p + Z dp,  R^k' = R^k GS(six_k),
/// so dp is metres per frame in the heading frame of the first, rotations are body-frame changes.
/// Kept here in its own units; networks see it normalised (statistics.h).

/// The delta between two poses: dp = Z^T (p' - p), six_k = rows12(R^k^T R^k').
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

/// The delta that changes nothing: no translation, identity rotations.
template <typename T>
StateVector<T> RestDelta() {
  return DeltaBetween(Pose<T>{}, Pose<T>{});
}

/// s' = step(s, d). Rotations are made orthonormal again at every step, so that rounding does not
/// build up over a rollout. `next` may be `pose`.
template <typename T>
void ApplyDelta(const Pose<T>& pose, const Heading<T>& heading,
                const Eigen::Ref<const StateVector<T>>& delta, Pose<T>& next) {
  next.translation = pose.translation + heading.ToWorld(delta.template head<3>());
  for (int k = 0; k < kNumBodyJoints; ++k) {
    const Matrix3<T> change = RotationFromRows12<T>(delta.template segment<6>(Rows12Of(k)));
    const Matrix3<T> product = pose.rotation[k] * change;
    next.rotation[k] = Orthonormalised<T>(product);
  }
}

/// From the gradient `next_bar` of s' to those of s (added to `pose_bar`) and of d (written):
///   p_bar += p'_bar,  phi_0_bar += g_a (Z (e_z x dp)) . p'_bar,  phi_k_bar += D_k phi_k'_bar,
///   dp_bar = Z^T p'_bar,  six_k_bar = J_GS(six_k)^T phi_k'_bar.
/// With `detached_heading` Z counts as constant, as in the authors' code.
template <typename T>
void ApplyDeltaVjp(const Heading<T>& heading, const Eigen::Ref<const StateVector<T>>& delta,
                   const Eigen::Ref<const TangentVector<T>>& next_bar, bool detached_heading,
                   Eigen::Ref<TangentVector<T>> pose_bar, Eigen::Ref<StateVector<T>> delta_bar) {
  const Vector3<T> p_bar = next_bar.template head<3>();
  const Vector3<T> local_bar = heading.FromWorld(p_bar);
  pose_bar.template head<3>() += p_bar;
  if (!detached_heading) {
    const T turn_bar = delta[0] * local_bar.y() - delta[1] * local_bar.x();
    pose_bar.template segment<3>(TangentOf(0)) += turn_bar * heading.gradient;
  }
  delta_bar.template head<3>() = local_bar;
  for (int k = 0; k < kNumBodyJoints; ++k) {
    const Vector6<T> six = delta.template segment<6>(Rows12Of(k));
    const Vector3<T> phi_bar = next_bar.template segment<3>(TangentOf(k));
    pose_bar.template segment<3>(TangentOf(k)) += RotationFromRows12<T>(six) * phi_bar;
    delta_bar.template segment<6>(Rows12Of(k)) = RotationFromRows12Vjp<T>(six, phi_bar);
  }
}

}  // namespace holdfast::wandr
