// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include <ceres/cost_function.h>

#include <Eigen/Core>

namespace holdfast {

/// Latents stay near the sample that they come from.
///
///   r = sqrt(lambda) (z - z_0),   n residuals
///
/// Parameter block: latents z (n), of one step or of all. With z_0 a sample of N(0, I) the result
/// stays at the radius where samples are; with z_0 = 0 this is the paper's prior, and draws motions
/// towards the mean one.
class LatentPrior final : public ceres::CostFunction {
 public:
  LatentPrior(Eigen::VectorXd centre, double weight)
      : centre_(std::move(centre)), scale_(std::sqrt(weight)) {
    set_num_residuals(static_cast<int>(centre_.size()));
    *mutable_parameter_block_sizes() = {num_residuals()};
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Index n = centre_.size();
    Eigen::Map<Eigen::VectorXd>(residuals, n) =
        scale_ * (Eigen::Map<const Eigen::VectorXd>(parameters[0], n) - centre_);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<Eigen::MatrixXd>(jacobians[0], n, n) = scale_ * Eigen::MatrixXd::Identity(n, n);
    }
    return true;
  }

 private:
  Eigen::VectorXd centre_;
  double scale_;
};

}  // namespace holdfast
