// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <utility>

#include <ceres/cost_function.h>

#include <Eigen/Core>

namespace holdfast {

/// Forces f >= 0 of least c |W f|^2 + |f - 1/4|^2 by their dual: y = c W f is the least of
///
///   sum_g max(0, 1/4 - w_g . y)^2 + |y|^2 / c,   and f_g = max(0, 1/4 - w_g . y)
///
/// Residuals: one for each column w_g of W (6 x n), then y / sqrt(c) (6). Parameter block: y (6).
class SqueezeDual final : public ceres::CostFunction {
 public:
  using Wrenches = Eigen::Matrix<double, 6, Eigen::Dynamic>;

  SqueezeDual(Wrenches wrenches, double balance_weight)
      : wrenches_(std::move(wrenches)), scale_(1.0 / std::sqrt(balance_weight)) {
    set_num_residuals(static_cast<int>(wrenches_.cols()) + 6);
    mutable_parameter_block_sizes()->assign(1, 6);
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** J) const override {
    const Eigen::Index n = wrenches_.cols();
    const Eigen::Map<const Eigen::Matrix<double, 6, 1>> y(parameters[0]);
    Eigen::Map<Eigen::VectorXd> r(residuals, n + 6);
    r << (0.25 - (wrenches_.transpose() * y).array()).max(0.0).matrix(), scale_ * y;
    if (J == nullptr || J[0] == nullptr) return true;
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor>> J_y(J[0], n + 6, 6);
    J_y.bottomRows<6>() = scale_ * Eigen::Matrix<double, 6, 6>::Identity();
    for (Eigen::Index g = 0; g < n; ++g) {
      J_y.row(g) = (r(g) > 0.0 ? -1.0 : 0.0) * wrenches_.col(g).transpose();
    }
    return true;
  }

 private:
  Wrenches wrenches_;
  double scale_;
};

}  // namespace holdfast
