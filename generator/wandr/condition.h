// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "generator/wandr/intention.h"
#include "generator/wandr/pose.h"
#include "generator/wandr/statistics.h"

namespace holdfast::wandr {

/// Where the parts of a condition c begin:
///   p_z 1 | orient_xy 6 | pose 126 | previous delta 135 | intention 9 (kPaper), 277 in all.
inline constexpr int kPreviousDeltaOf = kPoseFeatures;
inline constexpr int kIntentionOf = kPoseFeatures + kStateSize;

inline constexpr int ConditionSize(IntentionLayout layout) {
  return kIntentionOf + IntentionSize(layout);
}

/// The pose's part of c, normalised: height, root without heading, joints 1..21. `out` has
/// kPoseFeatures numbers.
template <typename T>
void WritePoseFeatures(const Pose<T>& pose, const Heading<T>& heading,
                       const Normaliser<T>& normaliser, T* out) {
  Eigen::Map<Eigen::Matrix<T, kPoseFeatures, 1>> features(out);
  features[0] = pose.translation.z();
  features.template segment<6>(1) = Rows12<T>(WithoutHeading<T>(heading, pose.rotation[0]));
  for (int k = 1; k < kNumBodyJoints; ++k) {
    features.template segment<6>(1 + 6 * k) = Rows12<T>(pose.rotation[k]);
  }
  features = (features - normaliser.pose.mean).cwiseProduct(normaliser.pose.scale);
}

/// Adds to `pose_bar` the gradient that `features_bar` (kPoseFeatures numbers) stands for.
template <typename T>
void WritePoseFeaturesVjp(const Pose<T>& pose, const Heading<T>& heading,
                          const Normaliser<T>& normaliser, const T* features_bar,
                          Eigen::Ref<TangentVector<T>> pose_bar) {
  const Eigen::Matrix<T, kPoseFeatures, 1> bar =
      Eigen::Map<const Eigen::Matrix<T, kPoseFeatures, 1>>(features_bar)
          .cwiseProduct(normaliser.pose.scale);
  pose_bar[2] += bar[0];
  pose_bar.template segment<3>(TangentOf(0)) += WithoutHeadingVjp<T>(
      heading, WithoutHeading<T>(heading, pose.rotation[0]), bar.template segment<6>(1));
  for (int k = 1; k < kNumBodyJoints; ++k) {
    pose_bar.template segment<3>(TangentOf(k)) +=
        Rows12Vjp<T>(pose.rotation[k], bar.template segment<6>(1 + 6 * k));
  }
}

/// d_norm of a delta, and back.
template <typename T>
StateVector<T> NormalisedDelta(const Normaliser<T>& n, const Eigen::Ref<const StateVector<T>>& d) {
  return (d - n.delta.mean).cwiseProduct(n.delta.scale);
}
template <typename T>
StateVector<T> DeltaOfNormalised(const Normaliser<T>& n,
                                 const Eigen::Ref<const StateVector<T>>& d) {
  return d.cwiseProduct(n.delta.deviation) + n.delta.mean;
}

/// s_norm of a state, as sequences are stored for training, and back.
template <typename T>
StateVector<T> NormalisedState(const Normaliser<T>& n, const Eigen::Ref<const StateVector<T>>& s) {
  return (s - n.state.mean).cwiseProduct(n.state.scale);
}
template <typename T>
StateVector<T> StateOfNormalised(const Normaliser<T>& n,
                                 const Eigen::Ref<const StateVector<T>>& s) {
  return s.cwiseProduct(n.state.deviation) + n.state.mean;
}

}  // namespace holdfast::wandr
