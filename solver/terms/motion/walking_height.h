// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>

#include <ceres/sized_cost_function.h>

namespace holdfast {

/// Who walks does so on legs that are nearly straight: the pelvis stays above some height.
///
///   r = sqrt(w) max(0, lowest - q_z),   one residual, metres
///
/// Parameter block: the pelvis (3, world, metres, z up).
class WalkingHeight final : public ceres::SizedCostFunction<1, 3> {
 public:
  WalkingHeight(double lowest_m, double weight) : lowest_(lowest_m), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const double below = lowest_ - parameters[0][2];
    residuals[0] = scale_ * std::max(0.0, below);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      jacobians[0][0] = jacobians[0][1] = 0.0;
      jacobians[0][2] = below > 0.0 ? -scale_ : 0.0;
    }
    return true;
  }

 private:
  double lowest_, scale_;
};

}  // namespace holdfast
