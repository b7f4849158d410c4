// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>

namespace holdfast {

/// The forearm points where the hand is to come from.
///
///   r = sqrt(w) ((q_wrist - q_elbow) / |q_wrist - q_elbow| - a),   3 residuals
///
/// Parameter blocks: positions of elbow and wrist (3 each, world, metres). a: unit vector.
class ApproachDirection final : public ceres::SizedCostFunction<3, 3, 3> {
 public:
  ApproachDirection(const Eigen::Vector3d& direction, double weight)
      : direction_(direction), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Vector3d way = Eigen::Map<const Eigen::Vector3d>(parameters[1]) -
                                Eigen::Map<const Eigen::Vector3d>(parameters[0]);
    const double length = std::max(way.norm(), 1e-9);
    const Eigen::Vector3d unit = way / length;
    Eigen::Map<Eigen::Vector3d>{residuals} = scale_ * (unit - direction_);
    if (jacobians == nullptr) return true;
    const Eigen::Matrix3d J_unit_way =
        scale_ / length * (Eigen::Matrix3d::Identity() - unit * unit.transpose());
    for (const int k : {0, 1}) {
      if (jacobians[k] == nullptr) continue;
      Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>{jacobians[k]} =
          k == 0 ? Eigen::Matrix3d(-J_unit_way) : J_unit_way;
    }
    return true;
  }

 private:
  Eigen::Vector3d direction_;
  double scale_;
};

}  // namespace holdfast
