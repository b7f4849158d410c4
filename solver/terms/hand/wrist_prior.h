// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/rotation.h"
#include "solver/unknowns/rotation_manifold.h"
#include "solver/unknowns/wrist_offset.h"

namespace holdfast {

/// E_w: the hands stay where the clip has them. With the offset B so far (in the body already) and
/// the unknown offset (C, c) on top of it,
///
///   E_w = |c_B + B c|^2 + l^2 |log(B C)|^2,   l = 0.1 m
///
/// 6 residuals, metres: a turn counts as what it moves at l, the length of a hand's palm. Parameter
/// blocks: C (4, x y z w, with RotationManifold), c (3, metres), both in the wrist's frame. Weight:
/// lambda_w, on the sum; residuals are scaled by its square root. Not part of the paper's energy.
class WristPrior final : public ceres::SizedCostFunction<6, 4, 3> {
 public:
  static constexpr double kLever = 0.1;  // metres

  WristPrior(const WristOffset& before, double weight)
      : before_(before), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Map<const Eigen::Quaterniond> C(parameters[0]);
    const Eigen::Map<const Eigen::Vector3d> c(parameters[1]);
    const Eigen::Vector3d turn = LogSO3((before_.rotation * C).toRotationMatrix());
    Eigen::Map<Eigen::Matrix<double, 6, 1>> r(residuals);
    r.head<3>() = scale_ * (before_.translation + before_.rotation * c);
    r.tail<3>() = scale_ * kLever * turn;
    if (jacobians == nullptr) return true;
    FillPoseJacobians(parameters, jacobians, 0, scale_, scale_ * kLever,
                      InverseLeftJacobianSO3(turn).transpose(),
                      before_.rotation.toRotationMatrix());
    return true;
  }

 private:
  WristOffset before_;
  double scale_;
};

}  // namespace holdfast
