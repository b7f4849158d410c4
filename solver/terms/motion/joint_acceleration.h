// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>

namespace holdfast {

/// A joint's motion is smooth.
///
///   r = sqrt(w) (q_0 - 2 q_1 + q_2) / dt^2,   3 residuals, m/s^2
///
/// Parameter blocks: the joint's positions in three frames that follow each other (3 each, world,
/// metres).
class JointAcceleration final : public ceres::SizedCostFunction<3, 3, 3, 3> {
 public:
  JointAcceleration(double dt_s, double weight) : scale_(std::sqrt(weight) / (dt_s * dt_s)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    for (int k = 0; k < 3; ++k) {
      residuals[k] = scale_ * (parameters[0][k] - 2.0 * parameters[1][k] + parameters[2][k]);
    }
    if (jacobians == nullptr) return true;
    for (int b = 0; b < 3; ++b) {
      if (jacobians[b] == nullptr) continue;
      Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>{jacobians[b]} =
          (b == 1 ? -2.0 : 1.0) * scale_ * Eigen::Matrix3d::Identity();
    }
    return true;
  }

 private:
  double scale_;
};

}  // namespace holdfast
