// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <ceres/cost_function.h>

namespace holdfast {

/// Not both feet leave the floor: of all foot joints the lowest stays low.
///
///   r = sqrt(w) max(0, min_k (q_k,z - rest_k) - allowed),   one residual, metres
///
/// Parameter blocks: positions q_k of the foot joints of one frame (3 each, world, metres);
/// `resting` their heights with the soles on the floor.
class Airborne final : public ceres::CostFunction {
 public:
  Airborne(std::vector<double> resting_m, double allowed_m, double weight)
      : resting_(std::move(resting_m)), allowed_(allowed_m), scale_(std::sqrt(weight)) {
    set_num_residuals(1);
    mutable_parameter_block_sizes()->assign(resting_.size(), 3);
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    std::size_t lowest = 0;
    double height = INFINITY;
    for (std::size_t k = 0; k < resting_.size(); ++k) {
      const double above = parameters[k][2] - resting_[k];
      if (above < height) {
        height = above;
        lowest = k;
      }
    }
    const double beyond = height - allowed_;
    residuals[0] = scale_ * std::max(0.0, beyond);
    if (jacobians == nullptr) return true;
    for (std::size_t k = 0; k < resting_.size(); ++k) {
      if (jacobians[k] == nullptr) continue;
      std::fill_n(jacobians[k], 3, 0.0);
      if (k == lowest && beyond > 0.0) jacobians[k][2] = scale_;
    }
    return true;
  }

 private:
  std::vector<double> resting_;
  double allowed_, scale_;
};

}  // namespace holdfast
