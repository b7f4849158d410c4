// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>

namespace holdfast {

/// Who reaches stands near: the pelvis is within an arm's reach of the goal, as seen from above.
///
///   r = sqrt(w) max(0, |S (q - G)| - farthest),   S = diag(1, 1, 0),   one residual, metres
///
/// Parameter block: the pelvis (3, world, metres). Without it a body that came to a halt too early
/// bends over what it lacks.
class StandNear final : public ceres::SizedCostFunction<1, 3> {
 public:
  StandNear(const Eigen::Vector3d& goal, double farthest_m, double weight)
      : goal_(goal.head<2>()), farthest_(farthest_m), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Vector2d way = Eigen::Map<const Eigen::Vector2d>(parameters[0]) - goal_;
    const double length = way.norm(), beyond = length - farthest_;
    residuals[0] = scale_ * std::max(0.0, beyond);
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    Eigen::Map<Eigen::Vector3d> slope(jacobians[0]);
    slope.setZero();
    if (beyond > 0.0) slope.head<2>() = scale_ / length * way;
    return true;
  }

 private:
  Eigen::Vector2d goal_;
  double farthest_, scale_;
};

}  // namespace holdfast
