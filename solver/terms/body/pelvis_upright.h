// SPDX-License-Identifier: MIT
#pragma once

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>

#include "geometry/rotation.h"

namespace holdfast {

/// A pelvis that no marker shows stands or sits upright.
///
///   r = (R e_y - e_z) / sigma,   3 residuals; sigma about radians
///
/// Block: root (6) of FreePose; R = exp(its last three numbers). World z is up.
class PelvisUpright final : public ceres::SizedCostFunction<3, 6> {
 public:
  explicit PelvisUpright(double sigma) : sigma_(sigma) {}

  bool Evaluate(double const* const* x, double* residuals, double** J) const override {
    const Eigen::Vector3d turn = Eigen::Map<const Eigen::Vector3d>(x[0] + 3);
    const Eigen::Vector3d up = ExpSO3(turn).col(1);
    Eigen::Map<Eigen::Vector3d>{residuals} = (up - Eigen::Vector3d::UnitZ()) / sigma_;
    if (J != nullptr && J[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 3, 6, Eigen::RowMajor>> J_root(J[0]);
      J_root.leftCols<3>().setZero();
      J_root.rightCols<3>() = -Skew<double>(up) * LeftJacobianSO3(turn) / sigma_;
    }
    return true;
  }

 private:
  double sigma_;
};

}  // namespace holdfast
