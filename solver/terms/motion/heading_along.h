// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>

namespace holdfast {

/// Who walks faces where the way goes.
///
///   r = sqrt(w) atan2(h x d, h . d),   h = S A e_z,   S = diag(1, 1, 0),   one residual, radians
///
/// Parameter block: the pelvis' rotation to the world (9, row by row; SMPL-X faces along its z); d
/// is the direction of the way. Returns false for a pelvis that faces straight up or down.
class HeadingAlong final : public ceres::SizedCostFunction<1, 9> {
 public:
  HeadingAlong(const Eigen::Vector2d& direction, double weight)
      : direction_(direction), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Vector2d facing(parameters[0][2], parameters[0][5]);
    if (facing.squaredNorm() < 1e-12) return false;
    residuals[0] = scale_ * std::atan2(facing.x() * direction_.y() - facing.y() * direction_.x(),
                                       facing.dot(direction_));
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    std::fill_n(jacobians[0], 9, 0.0);
    jacobians[0][2] = scale_ * facing.y() / facing.squaredNorm();
    jacobians[0][5] = -scale_ * facing.x() / facing.squaredNorm();
    return true;
  }

 private:
  Eigen::Vector2d direction_;
  double scale_;
};

}  // namespace holdfast
