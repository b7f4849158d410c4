// SPDX-License-Identifier: MIT
#pragma once

#include <utility>

#include <ceres/cost_function.h>

#include <Eigen/Core>

namespace holdfast {

/// A marker sits about where its name says.
///
///   r = (x - a - A betas) / sigma    3 residuals, metres over metres
///
/// x: place in the frame of the joint that the marker follows. Blocks: betas (B), place x (3).
class MarkerPlacePrior final : public ceres::CostFunction {
 public:
  /// `J_usual` (3 x B).
  MarkerPlacePrior(const Eigen::Vector3d& usual, Eigen::Matrix3Xd J_usual, double sigma_m)
      : usual_(usual), J_usual_(std::move(J_usual)), sigma_m_(sigma_m) {
    set_num_residuals(3);
    *mutable_parameter_block_sizes() = {static_cast<int>(J_usual_.cols()), 3};
  }

  bool Evaluate(double const* const* x, double* residuals, double** J) const override {
    using RowMajor = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>;
    const Eigen::Map<const Eigen::VectorXd> betas(x[0], J_usual_.cols());
    const Eigen::Map<const Eigen::Vector3d> place(x[1]);
    Eigen::Map<Eigen::Vector3d>{residuals} = (place - usual_ - J_usual_ * betas) / sigma_m_;
    if (J != nullptr && J[0] != nullptr) {
      Eigen::Map<RowMajor>(J[0], 3, J_usual_.cols()) = -J_usual_ / sigma_m_;
    }
    if (J != nullptr && J[1] != nullptr) {
      Eigen::Map<RowMajor>(J[1], 3, 3) = Eigen::Matrix3d::Identity() / sigma_m_;
    }
    return true;
  }

 private:
  Eigen::Vector3d usual_;
  Eigen::Matrix3Xd J_usual_;
  double sigma_m_;
};

}  // namespace holdfast
