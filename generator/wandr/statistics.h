// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

#include <Eigen/Core>

#include "generator/nn/network_weights.h"
#include "generator/wandr/intention.h"
#include "generator/wandr/pose.h"

namespace holdfast::wandr {

/// Mean and standard deviation per component of one feature.
template <int kSize>
struct FeatureMoments {
  Eigen::Matrix<double, kSize, 1> mean = Eigen::Matrix<double, kSize, 1>::Zero();
  Eigen::Matrix<double, kSize, 1> deviation = Eigen::Matrix<double, kSize, 1>::Ones();
};

/// Normalization statistics of features, named as in the published file. The intention is not
/// normalized. Units: meters, meters per frame, entries of rotation matrices.
struct Statistics {
  FeatureMoments<3> body_transl;
  FeatureMoments<6> body_orient;     ///< rows12(R^0): for stored states only
  FeatureMoments<6> body_orient_xy;  ///< rows12(Z^T R^0)
  FeatureMoments<126> body_pose;
  FeatureMoments<3> body_transl_delta_pelv_xy;
  FeatureMoments<6> body_orient_delta;
  FeatureMoments<126> body_pose_delta;
};

/// Computes Statistics over states and the deltas between them in one numerically stable pass
/// (Welford 1962). Deviations use the unbiased estimator.
class StatisticsGatherer {
 public:
  /// Adds a sequence (135 x F) at 30 fps. Each frame counts once; the first frame's delta is rest.
  void Add(const Eigen::Ref<const StateMatrix<double>>& states);
  /// Throws Error for fewer than two frames.
  Statistics Finish() const;

 private:
  static constexpr int kSize = kStateSize + 6 + kStateSize;  // state, orient_xy, delta

  std::int64_t count_ = 0;
  Eigen::Matrix<double, kSize, 1> mean_ = Eigen::Matrix<double, kSize, 1>::Zero();
  Eigen::Matrix<double, kSize, 1> squares_ = Eigen::Matrix<double, kSize, 1>::Zero();
};

/// Reads `statistics.<feature>.mean` and `.std`. Throws Error naming a missing, wrongly sized,
/// non-finite or negative entry.
Statistics StatisticsFromTensors(const nn::TensorMap& tensors, const std::string& where);
void AddTensors(const Statistics& statistics, nn::TensorMap& tensors);

/// x_norm = (x - mean) scale, component by component, in the precision of a network.
template <typename T, int kSize>
struct Affine {
  Eigen::Matrix<T, kSize, 1> mean;
  Eigen::Matrix<T, kSize, 1> scale;      ///< 1 / (std + 1e-5)
  Eigen::Matrix<T, kSize, 1> deviation;  ///< std + 1e-5
};

/// Size of the pose part of the condition: p_z, rows12(R_xy), rows12 of joints 1..21.
inline constexpr int kPoseFeatures = 1 + 6 + 126;

/// Statistics in the layout of the state and condition vectors, for fast normalization.
template <typename T>
struct Normalizer {
  explicit Normalizer(const Statistics& statistics);

  Affine<T, kPoseFeatures> pose;  ///< p_z | orient_xy | pose
  Affine<T, kStateSize> delta;    ///< 3 | 6 | 126
};

extern template struct Normalizer<float>;
extern template struct Normalizer<double>;

/// Offsets of the parts of a condition c:
///   p_z 1 | orient_xy 6 | pose 126 | previous delta 135 | intention 9 (kPaper), 277 in all.
inline constexpr int kPreviousDeltaOf = kPoseFeatures;
inline constexpr int kIntentionOf = kPoseFeatures + kStateSize;

inline constexpr int ConditionSize(IntentionLayout layout) {
  return kIntentionOf + IntentionSize(layout);
}

/// Writes the pose part of c, normalized: height, root without heading, joints 1..21. `out` has
/// kPoseFeatures values.
template <typename T>
void WritePoseFeatures(const Pose<T>& pose, const Heading<T>& heading,
                       const Normalizer<T>& normalizer, T* out) {
  Eigen::Map<Eigen::Matrix<T, kPoseFeatures, 1>> features(out);
  features[0] = pose.translation.z();
  features.template segment<6>(1) = Rows12<T>(WithoutHeading<T>(heading, pose.rotation[0]));
  for (int k = 1; k < kNumBodyJoints; ++k) {
    features.template segment<6>(1 + 6 * k) = Rows12<T>(pose.rotation[k]);
  }
  features = (features - normalizer.pose.mean).cwiseProduct(normalizer.pose.scale);
}

/// Adds to `pose_bar` the gradient for `features_bar` (kPoseFeatures values).
template <typename T>
void WritePoseFeaturesVjp(const Pose<T>& pose, const Heading<T>& heading,
                          const Normalizer<T>& normalizer, const T* features_bar,
                          Eigen::Ref<TangentVector<T>> pose_bar) {
  const Eigen::Matrix<T, kPoseFeatures, 1> bar =
      Eigen::Map<const Eigen::Matrix<T, kPoseFeatures, 1>>(features_bar)
          .cwiseProduct(normalizer.pose.scale);
  pose_bar[2] += bar[0];
  pose_bar.template segment<3>(TangentOf(0)) += WithoutHeadingVjp<T>(
      heading, WithoutHeading<T>(heading, pose.rotation[0]), bar.template segment<6>(1));
  for (int k = 1; k < kNumBodyJoints; ++k) {
    pose_bar.template segment<3>(TangentOf(k)) +=
        Rows12Vjp<T>(pose.rotation[k], bar.template segment<6>(1 + 6 * k));
  }
}

/// Normalizes a delta, and the inverse.
template <typename T>
StateVector<T> NormalizedDelta(const Normalizer<T>& n, const Eigen::Ref<const StateVector<T>>& d) {
  return (d - n.delta.mean).cwiseProduct(n.delta.scale);
}
template <typename T>
StateVector<T> DeltaOfNormalized(const Normalizer<T>& n,
                                 const Eigen::Ref<const StateVector<T>>& d) {
  return d.cwiseProduct(n.delta.deviation) + n.delta.mean;
}

}  // namespace holdfast::wandr
