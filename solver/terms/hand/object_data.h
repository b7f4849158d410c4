// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/rotation.h"
#include "solver/unknowns/rotation_manifold.h"

namespace holdfast {

/// Keeps the object, or a frame F = (R_f, f) fixed to it, close to a given pose (R0, T0): that of a
/// recording or its resting pose.
///
///   E = |R f + T - T0|^2 + l^2 |log(R0^T R R_f)|^2,   m^2,   l = 0.1 m
///
/// 6 residuals, meters: a rotation counts as the displacement at l, about the size of a handheld
/// object; with l = 0 only the position counts. Parameter blocks: orientation q (4, x y z w, with
/// RotationManifold), translation T (3, meters). `weight` (1/m^2) on the sum; residuals are scaled
/// by its square root.
class ObjectData final : public ceres::SizedCostFunction<6, 4, 3> {
 public:
  static constexpr double kLever = 0.1;  // meters

  ObjectData(const ObjectPose& given, double weight, const ObjectPose& fixed = {},
             double lever_m = kLever)
      : given_(given), fixed_(fixed), scale_(std::sqrt(weight)), turn_scale_(lever_m * scale_) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Map<const Eigen::Quaterniond> q(parameters[0]);
    const Eigen::Matrix3d R = q.toRotationMatrix();
    const Eigen::Matrix3d R_f = fixed_.orientation.toRotationMatrix();
    const Eigen::Vector3d turn =
        LogSO3(given_.orientation.conjugate().toRotationMatrix() * R * R_f);
    Eigen::Map<Eigen::Matrix<double, 6, 1>> r(residuals);
    r.head<3>() = scale_ * (R * fixed_.translation +
                            Eigen::Map<const Eigen::Vector3d>(parameters[1]) - given_.translation);
    r.tail<3>() = turn_scale_ * turn;
    if (jacobians == nullptr) return true;
    FillPoseJacobians(parameters, jacobians, 0, scale_, turn_scale_,
                      InverseLeftJacobianSO3(turn).transpose() * R_f.transpose(),
                      Eigen::Matrix3d::Identity());
    if (jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 6, 4, Eigen::RowMajor>>{jacobians[0]}.topRows<3>() =
          scale_ * RotationManifold::Lift(-R * Skew(fixed_.translation), parameters[0]);
    }
    return true;
  }

 private:
  ObjectPose given_, fixed_;
  double scale_, turn_scale_;
};

}  // namespace holdfast
