// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>

#include <ceres/sized_cost_function.h>

namespace holdfast {

/// A joint does not sink below the height that it has when its foot stands on the floor.
///
///   r = sqrt(w) max(0, lowest - q_z),   one residual, metres
///
/// Parameter block: the joint's position q (3, world, metres, floor z = 0).
class FloorContact final : public ceres::SizedCostFunction<1, 3> {
 public:
  FloorContact(double lowest_m, double weight) : lowest_(lowest_m), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const double depth = lowest_ - parameters[0][2];
    residuals[0] = scale_ * std::max(0.0, depth);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      jacobians[0][0] = jacobians[0][1] = 0.0;
      jacobians[0][2] = depth > 0.0 ? -scale_ : 0.0;
    }
    return true;
  }

 private:
  double lowest_, scale_;
};

}  // namespace holdfast
