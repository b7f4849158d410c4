// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>

namespace holdfast {

/// Who walks holds the trunk upright.
///
///   r = sqrt(w) max(0, |S (n - q)| - farthest),   S = diag(1, 1, 0),   one residual, metres
///
/// Parameter blocks: pelvis q and neck n (3 each, world, metres). A trunk is half a metre long:
/// five centimetres are six degrees.
class UprightTrunk final : public ceres::SizedCostFunction<1, 3, 3> {
 public:
  UprightTrunk(double farthest_m, double weight)
      : farthest_(farthest_m), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Vector2d off(parameters[1][0] - parameters[0][0],
                              parameters[1][1] - parameters[0][1]);
    const double length = off.norm(), beyond = length - farthest_;
    residuals[0] = scale_ * std::max(0.0, beyond);
    if (jacobians == nullptr) return true;
    Eigen::Vector3d slope = Eigen::Vector3d::Zero();
    if (beyond > 0.0) slope.head<2>() = scale_ / length * off;
    if (jacobians[0] != nullptr) Eigen::Map<Eigen::Vector3d>{jacobians[0]} = -slope;
    if (jacobians[1] != nullptr) Eigen::Map<Eigen::Vector3d>{jacobians[1]} = slope;
    return true;
  }

 private:
  double farthest_, scale_;
};

}  // namespace holdfast
