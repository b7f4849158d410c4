// SPDX-License-Identifier: MIT
#pragma once

#include <ceres/cost_function.h>

#include <Eigen/Core>

namespace holdfast {

/// Joints do not jerk: what is not seen for a while goes on as it went.
///
///   r = (q_t-1 - 2 q_t + q_t+1) / sigma,   n residuals
///
/// q: numbers of a pose (FreePose) in three frames, one block each; sigma (n): acceleration of one
/// standard deviation times the square of the time between frames, radians or metres.
class PoseAcceleration final : public ceres::CostFunction {
 public:
  explicit PoseAcceleration(Eigen::VectorXd sigma) : weight_(sigma.cwiseInverse()) {
    set_num_residuals(static_cast<int>(weight_.size()));
    mutable_parameter_block_sizes()->assign(3, static_cast<int>(weight_.size()));
  }

  bool Evaluate(double const* const* x, double* residuals, double** J) const override {
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const Eigen::Index n = weight_.size();
    const Eigen::Map<const Eigen::VectorXd> a(x[0], n), b(x[1], n), c(x[2], n);
    Eigen::Map<Eigen::VectorXd>(residuals, n) = weight_.cwiseProduct(a - 2.0 * b + c);
    for (int k = 0; J != nullptr && k < 3; ++k) {
      if (J[k] == nullptr) continue;
      Eigen::Map<RowMajor> J_q(J[k], n, n);
      J_q.setZero();
      J_q.diagonal() = (k == 1 ? -2.0 : 1.0) * weight_;
    }
    return true;
  }

 private:
  Eigen::VectorXd weight_;
};

}  // namespace holdfast
