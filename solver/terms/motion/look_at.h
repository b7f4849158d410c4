// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>

namespace holdfast {

/// The face is turned to a place.
///
///   r = sqrt(w) (A e_z - g),   g = (G - q) / |G - q|,   3 residuals, about radians
///
/// Parameter blocks: the head's rotation A to the world (9, row by row; SMPL-X faces look along its
/// z), the head's position q (3, world, metres).
class LookAt final : public ceres::SizedCostFunction<3, 9, 3> {
 public:
  LookAt(const Eigen::Vector3d& goal, double weight) : goal_(goal), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Vector3d way = goal_ - Eigen::Map<const Eigen::Vector3d>(parameters[1]);
    const double distance = std::max(way.norm(), 1e-6);
    const Eigen::Vector3d wanted = way / distance;
    for (int k = 0; k < 3; ++k) residuals[k] = scale_ * (parameters[0][3 * k + 2] - wanted[k]);
    if (jacobians == nullptr) return true;
    if (jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 3, 9, Eigen::RowMajor>> J(jacobians[0]);
      J.setZero();
      for (int k = 0; k < 3; ++k) J(k, 3 * k + 2) = scale_;
    }
    if (jacobians[1] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>{jacobians[1]} =
          scale_ / distance * (Eigen::Matrix3d::Identity() - wanted * wanted.transpose());
    }
    return true;
  }

 private:
  Eigen::Vector3d goal_;
  double scale_;
};

}  // namespace holdfast
