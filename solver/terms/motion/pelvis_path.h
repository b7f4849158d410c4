// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>

namespace holdfast {

/// The pelvis is on its way: near where a walk at an even pace would have it.
///
///   r = sqrt(w) S (q - reference),   2 residuals, metres
///
/// Parameter block: the pelvis (3, world, metres). Keeps progress spread over the time, so that a
/// motion does not stand first and rush later.
class PelvisPath final : public ceres::SizedCostFunction<2, 3> {
 public:
  PelvisPath(const Eigen::Vector2d& reference, double weight)
      : reference_(reference), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    for (const int k : {0, 1}) residuals[k] = scale_ * (parameters[0][k] - reference_[k]);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>>{jacobians[0]} << scale_, 0.0, 0.0,
          0.0, scale_, 0.0;
    }
    return true;
  }

 private:
  Eigen::Vector2d reference_;
  double scale_;
};

}  // namespace holdfast
