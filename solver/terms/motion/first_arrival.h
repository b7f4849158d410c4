// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <ceres/cost_function.h>

#include <Eigen/Core>

namespace holdfast {

/// A joint comes to a place at some time of a window: the soft minimum of its distance over n
/// frames,
///
///   s^2 = -tau^2 log( sum_t exp(-|q_t - G|^2 / tau^2) / n ),   r = sqrt(w) s
///
/// One residual, metres; never less than the least distance, and near it for small tau. The
/// gradient of s^2 / 2 is sum_t p_t (q_t - G) with p = softmax(-|q_t - G|^2 / tau^2): frames share
/// it by how close they are. Parameter blocks: the joint's positions q_t (n times 3, world,
/// metres). Leaves the time of arrival open.
class FirstArrival final : public ceres::CostFunction {
 public:
  /// `tau_m` as a distance, metres.
  FirstArrival(const Eigen::Vector3d& goal, int num_frames, double tau_m, double weight)
      : goal_(goal), tau_(tau_m), scale_(std::sqrt(weight)) {
    set_num_residuals(1);
    mutable_parameter_block_sizes()->assign(static_cast<std::size_t>(num_frames), 3);
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const std::size_t n = parameter_block_sizes().size();
    std::vector<double> share(n);
    double least = INFINITY;
    for (std::size_t t = 0; t < n; ++t) {
      share[t] = (Eigen::Map<const Eigen::Vector3d>(parameters[t]) - goal_).squaredNorm();
      least = std::min(least, share[t]);
    }
    double sum = 0.0;
    for (double& value : share) sum += value = std::exp((least - value) / (tau_ * tau_));
    const double squared = least - tau_ * tau_ * std::log(sum / static_cast<double>(n));
    const double s = std::sqrt(std::max(squared, 1e-18));
    residuals[0] = scale_ * s;
    if (jacobians == nullptr) return true;
    for (std::size_t t = 0; t < n; ++t) {
      if (jacobians[t] == nullptr) continue;
      Eigen::Map<Eigen::Vector3d>{jacobians[t]} =
          scale_ * share[t] / (sum * s) *
          (Eigen::Map<const Eigen::Vector3d>(parameters[t]) - goal_);
    }
    return true;
  }

 private:
  Eigen::Vector3d goal_;
  double tau_, scale_;
};

}  // namespace holdfast
