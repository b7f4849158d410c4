// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <vector>

#include <ceres/cost_function.h>

#include <Eigen/Core>

namespace holdfast {

/// A limit of a joint: low <= axis^T q_j <= high.
struct PoseLimit {
  int column = 0;                                   ///< of the first of `axis` in q
  Eigen::VectorXd axis = Eigen::Vector3d::UnitY();  ///< unit
  double low = 0.0, high = 0.0;                     ///< radians
};

/// What is not marked rests, and joints bend no farther than joints do.
///
///   r   = W (q - rest)                                                  n residuals
///   r_l = (max(0, a_l - high_l) - max(0, low_l - a_l)) / sigma          one a limit
///
/// a_l: the limit's component of q (FreePose), radians; W: the square root of the inverse
/// covariance. Block: q (n).
class PoseRest final : public ceres::CostFunction {
 public:
  PoseRest(Eigen::VectorXd rest, Eigen::MatrixXd root_information, std::vector<PoseLimit> limits,
           double sigma_rad)
      : rest_(std::move(rest)),
        W_(std::move(root_information)),
        limits_(std::move(limits)),
        sigma_(sigma_rad) {
    set_num_residuals(static_cast<int>(W_.rows()) + static_cast<int>(limits_.size()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(rest_.size()));
  }

  bool Evaluate(double const* const* x, double* residuals, double** J) const override {
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const Eigen::Map<const Eigen::VectorXd> q(x[0], rest_.size());
    Eigen::Map<Eigen::VectorXd> r(residuals, num_residuals());
    r.head(W_.rows()) = W_ * (q - rest_);
    const bool with_jacobian = J != nullptr && J[0] != nullptr;
    Eigen::Map<RowMajor> J_q(with_jacobian ? J[0] : nullptr, num_residuals(), rest_.size());
    if (with_jacobian) {
      J_q.setZero();
      J_q.topRows(W_.rows()) = W_;
    }
    for (std::size_t l = 0; l < limits_.size(); ++l) {
      const PoseLimit& limit = limits_[l];
      const Eigen::Index row = W_.rows() + static_cast<Eigen::Index>(l);
      const double a = limit.axis.dot(q.segment(limit.column, limit.axis.size()));
      r(row) = (std::max(0.0, a - limit.high) - std::max(0.0, limit.low - a)) / sigma_;
      if (with_jacobian && r(row) != 0.0) {
        J_q.row(row).segment(limit.column, limit.axis.size()) = limit.axis.transpose() / sigma_;
      }
    }
    return true;
  }

 private:
  Eigen::VectorXd rest_;
  Eigen::MatrixXd W_;
  std::vector<PoseLimit> limits_;
  double sigma_;
};

}  // namespace holdfast
