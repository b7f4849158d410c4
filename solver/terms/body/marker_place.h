// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <ceres/cost_function.h>

#include <Eigen/Core>

namespace holdfast {

/// Markers sit about where their names say, on a body about as usual.
///
///   r_k = (x_k - a_k - A_k betas) / sigma_k    3 M residuals, metres over metres
///   r   = betas                                B residuals
///
/// x_k: place in the frame of the joint that marker k follows. Blocks: betas (B), places x (3 M).
class MarkerPlacePrior final : public ceres::CostFunction {
 public:
  /// `usual` (3 M), `J_usual` (3 M x B), `sigma_m` (M).
  MarkerPlacePrior(Eigen::VectorXd usual, Eigen::MatrixXd J_usual, std::vector<double> sigma_m)
      : usual_(std::move(usual)), J_usual_(std::move(J_usual)), sigma_m_(std::move(sigma_m)) {
    set_num_residuals(static_cast<int>(usual_.size() + J_usual_.cols()));
    *mutable_parameter_block_sizes() = {static_cast<int>(J_usual_.cols()),
                                        static_cast<int>(usual_.size())};
  }

  bool Evaluate(double const* const* x, double* residuals, double** J) const override {
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const Eigen::Index rows = usual_.size(), shape = J_usual_.cols();
    const Eigen::Map<const Eigen::VectorXd> betas(x[0], shape), places(x[1], rows);
    Eigen::VectorXd weight(rows);
    for (Eigen::Index i = 0; i < rows; ++i) weight(i) = 1.0 / sigma_m_[i / 3];
    Eigen::Map<Eigen::VectorXd> r(residuals, num_residuals());
    r.head(rows) = weight.cwiseProduct(places - usual_ - J_usual_ * betas);
    r.tail(shape) = betas;
    if (J != nullptr && J[0] != nullptr) {
      Eigen::Map<RowMajor> J_betas(J[0], num_residuals(), shape);
      J_betas.topRows(rows) = -(weight.asDiagonal() * J_usual_);
      J_betas.bottomRows(shape).setIdentity();
    }
    if (J != nullptr && J[1] != nullptr) {
      Eigen::Map<RowMajor> J_places(J[1], num_residuals(), rows);
      J_places.setZero();
      J_places.topRows(rows).diagonal() = weight;
    }
    return true;
  }

 private:
  Eigen::VectorXd usual_;
  Eigen::MatrixXd J_usual_;
  std::vector<double> sigma_m_;
};

}  // namespace holdfast
