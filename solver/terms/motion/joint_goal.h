// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>

namespace holdfast {

/// A joint is at a place.
///
///   r = sqrt(w) (q - G),   3 residuals, metres
///
/// Parameter block: the joint's position q (3, world, metres). `weight` w on the sum. This is the
/// goal of WANDR's VAE + opt at a given frame (Diomataris et al. 2024, sec. 4).
class JointGoal final : public ceres::SizedCostFunction<3, 3> {
 public:
  JointGoal(const Eigen::Vector3d& goal, double weight) : goal_(goal), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    Eigen::Map<Eigen::Vector3d>{residuals} =
        scale_ * (Eigen::Map<const Eigen::Vector3d>(parameters[0]) - goal_);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>{jacobians[0]} =
          scale_ * Eigen::Matrix3d::Identity();
    }
    return true;
  }

 private:
  Eigen::Vector3d goal_;
  double scale_;
};

}  // namespace holdfast
