// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

#include <Eigen/Core>

#include "generator/nn/mlp_weights.h"
#include "generator/wandr/pose.h"

namespace holdfast::wandr {

/// Mean and standard deviation of one feature, per component.
template <int kSize>
struct FeatureMoments {
  Eigen::Matrix<double, kSize, 1> mean = Eigen::Matrix<double, kSize, 1>::Zero();
  Eigen::Matrix<double, kSize, 1> deviation = Eigen::Matrix<double, kSize, 1>::Ones();

  /// x_norm = (x - mean) / (std + 1e-5).
  Eigen::Matrix<double, kSize, 1> Scale() const {
    return (deviation.array() + 1e-5).inverse().matrix();
  }
};

/// The statistics that features are normalised with, by the names of the published file; those of
/// the intention have none. Units: metres, metres per frame, entries of rotation matrices.
struct Statistics {
  FeatureMoments<3> body_transl;
  FeatureMoments<6> body_orient;     ///< rows12(R^0): for stored states only
  FeatureMoments<6> body_orient_xy;  ///< rows12(Z^T R^0)
  FeatureMoments<126> body_pose;
  FeatureMoments<3> body_transl_delta_pelv_xy;
  FeatureMoments<6> body_orient_delta;
  FeatureMoments<126> body_pose_delta;
};

/// Gathers Statistics over states and the deltas between them, in one pass, whatever the order of
/// magnitude (Welford 1962). The deviation is the unbiased estimator.
class StatisticsGatherer {
 public:
  /// A sequence (135 x F) at 30 fps. Each frame counts once; the first one's delta is rest.
  void Add(const Eigen::Ref<const StateMatrix<double>>& states);
  std::int64_t NumFrames() const { return count_; }
  /// Throws Error with fewer than two frames.
  Statistics Finish() const;

 private:
  static constexpr int kSize = kStateSize + 6 + kStateSize;  // state, orient_xy, delta

  std::int64_t count_ = 0;
  Eigen::Matrix<double, kSize, 1> mean_ = Eigen::Matrix<double, kSize, 1>::Zero();
  Eigen::Matrix<double, kSize, 1> squares_ = Eigen::Matrix<double, kSize, 1>::Zero();
};

/// Reads `statistics.<feature>.mean` and `.std`. Throws Error naming what is missing, misshapen,
/// not finite or negative.
Statistics StatisticsFromTensors(const nn::TensorMap& tensors, const std::string& where);
void AddTensors(const Statistics& statistics, nn::TensorMap& tensors);

/// x_norm = (x - mean) scale, component by component, in the precision of a network.
template <typename T, int kSize>
struct Affine {
  Eigen::Matrix<T, kSize, 1> mean;
  Eigen::Matrix<T, kSize, 1> scale;      ///< 1 / (std + 1e-5)
  Eigen::Matrix<T, kSize, 1> deviation;  ///< std + 1e-5
};

/// Numbers of the condition that are about the pose: p_z, rows12(R_xy), rows12 of joints 1..21.
inline constexpr int kPoseFeatures = 1 + 6 + 126;

/// Statistics as the loops use them, blocks in the order of the vectors they belong to.
template <typename T>
struct Normaliser {
  explicit Normaliser(const Statistics& statistics);

  Affine<T, kPoseFeatures> pose;  ///< p_z | orient_xy | pose
  Affine<T, kStateSize> delta;    ///< 3 | 6 | 126
  Affine<T, kStateSize> state;    ///< 3 | 6 | 126
};

extern template struct Normaliser<float>;
extern template struct Normaliser<double>;

}  // namespace holdfast::wandr
