// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>

namespace holdfast {

/// Nobody is asked to spin.
///
///   r = sqrt(w) max(0, |a| / dt - fastest),   one residual, rad/s
///   a = atan2(h x h', h . h'),   h = S A e_z,   S = diag(1, 1, 0)
///
/// Parameter blocks: the pelvis' rotation to the world in one frame and a later one (9 each, row by
/// row; SMPL-X faces along its z); dt between them, seconds. Returns false for a pelvis that faces
/// straight up or down.
class HeadingTurn final : public ceres::SizedCostFunction<1, 9, 9> {
 public:
  HeadingTurn(double fastest_rad_s, double dt_s, double weight)
      : fastest_(fastest_rad_s), dt_(dt_s), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Vector2d before(parameters[0][2], parameters[0][5]);
    const Eigen::Vector2d after(parameters[1][2], parameters[1][5]);
    if (before.squaredNorm() < 1e-12 || after.squaredNorm() < 1e-12) return false;
    const double angle =
        std::atan2(before.x() * after.y() - before.y() * after.x(), before.dot(after));
    const double beyond = std::abs(angle) / dt_ - fastest_;
    residuals[0] = scale_ * std::max(0.0, beyond);
    if (jacobians == nullptr) return true;
    const double slope = beyond > 0.0 ? std::copysign(scale_ / dt_, angle) : 0.0;
    const auto write = [](double* jacobian, const Eigen::Vector2d& facing, double by) {
      if (jacobian == nullptr) return;
      std::fill_n(jacobian, 9, 0.0);
      jacobian[2] = -by * facing.y() / facing.squaredNorm();
      jacobian[5] = by * facing.x() / facing.squaredNorm();
    };
    write(jacobians[0], before, -slope);
    write(jacobians[1], after, slope);
    return true;
  }

 private:
  double fastest_, dt_, scale_;
};

}  // namespace holdfast
