// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>

#include <ceres/sized_cost_function.h>

namespace holdfast {

/// A joint turns no farther than captured bodies turn it.
///
///   r = sqrt(w) max(0, angle(R) - limit),   cos(angle) = (tr R - 1) / 2,   one residual, radians
///
/// Parameter block: the joint's rotation R relative to its parent (9, row by row).
class RotationRange final : public ceres::SizedCostFunction<1, 9> {
 public:
  RotationRange(double limit_rad, double weight) : limit_(limit_rad), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const double* const R = parameters[0];
    const double cosine = std::clamp(0.5 * (R[0] + R[4] + R[8] - 1.0), -1.0, 1.0);
    const double beyond = std::acos(cosine) - limit_;
    residuals[0] = scale_ * std::max(0.0, beyond);
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    std::fill_n(jacobians[0], 9, 0.0);
    if (beyond > 0.0) {
      const double sine = std::max(std::sqrt(1.0 - cosine * cosine), 1e-3);
      for (const int k : {0, 4, 8}) jacobians[0][k] = -0.5 * scale_ / sine;
    }
    return true;
  }

 private:
  double limit_, scale_;
};

}  // namespace holdfast
