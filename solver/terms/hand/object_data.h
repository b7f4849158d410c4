// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/pose.h"
#include "geometry/rotation.h"
#include "solver/unknowns/rotation_manifold.h"

namespace holdfast {

/// The object stays close to a given pose (R0, T0): that of a recording, or of where it lies.
///
///   E = |T - T0|^2 + l^2 |log(R0^T R)|^2,   m^2,   l = 0.1 m
///
/// 6 residuals, metres: a turn counts as what it moves at l, about a handheld object's size.
/// Parameter blocks: orientation q (4, x y z w, with RotationManifold), translation T (3, metres).
/// `weight` (1/m^2) on the sum; residuals are scaled by its square root.
class ObjectData final : public ceres::SizedCostFunction<6, 4, 3> {
 public:
  static constexpr double kLever = 0.1;  // metres

  ObjectData(const ObjectPose& given, double weight) : given_(given), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Map<const Eigen::Quaterniond> q(parameters[0]);
    const Eigen::Vector3d turn = LogSO3((given_.orientation.conjugate() * q).toRotationMatrix());
    Eigen::Map<Eigen::Matrix<double, 6, 1>> r(residuals);
    r.head<3>() = scale_ * (Eigen::Map<const Eigen::Vector3d>(parameters[1]) - given_.translation);
    r.tail<3>() = scale_ * kLever * turn;
    if (jacobians == nullptr) return true;
    FillPoseJacobians(parameters, jacobians, 0, scale_, scale_ * kLever,
                      InverseLeftJacobianSO3(turn).transpose(), Eigen::Matrix3d::Identity());
    return true;
  }

 private:
  ObjectPose given_;
  double scale_;
};

}  // namespace holdfast
