// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/hand_model.h"
#include "geometry/rotation.h"
#include "solver/unknowns/rotation_manifold.h"

namespace holdfast {

/// E_t: little change from the previous frame (IMoS, Ghosh et al. 2023, eq. 9, E_r there, read as a
/// sum of squared norms, the rotation's on SO(3)).
///
///   E_t = |log(R_prev^T R)|^2 + |T - T_prev|^2 + |P - P_prev|^2
///
/// 51 residuals: log of the rotation since the previous frame (radians, object's frame),
/// translation (metres, world), finger axis-angles (radians). Parameter blocks: orientation q (4, x
/// y z w, with RotationManifold), translation T (3), fingers P (45). Weight: lambda_t, on the sum;
/// residuals are scaled by its square root.
class Temporal final : public ceres::SizedCostFunction<51, 4, 3, kHandDofs> {
 public:
  Temporal(const Eigen::Quaterniond& orientation, const Eigen::Vector3d& translation,
           const FingerPose& fingers, double weight)
      : orientation_(orientation),
        translation_(translation),
        fingers_(fingers),
        scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Map<const Eigen::Quaterniond> q(parameters[0]);
    Eigen::Map<Eigen::Matrix<double, 51, 1>> r(residuals);
    const Eigen::Vector3d turn = LogSO3((orientation_.conjugate() * q).toRotationMatrix());
    r.head<3>() = scale_ * turn;
    r.segment<3>(3) = scale_ * (Eigen::Map<const Eigen::Vector3d>(parameters[1]) - translation_);
    r.tail<kHandDofs>() = scale_ * (Eigen::Map<const FingerPose>(parameters[2]) - fingers_);
    if (jacobians == nullptr) return true;
    if (jacobians[0] != nullptr) {
      // log(exp(turn) exp(delta)) = turn + Jr^{-1}(turn) delta, and Jr(w) = Jl(w)^T.
      Eigen::Matrix3d J_turn_delta = InverseLeftJacobianSO3(turn).transpose();
      Eigen::Map<Eigen::Matrix<double, 51, 4, Eigen::RowMajor>> J(jacobians[0]);
      J.setZero();
      J.topRows<3>() = scale_ * RotationManifold::Lift(J_turn_delta, parameters[0]);
    }
    if (jacobians[1] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 51, 3, Eigen::RowMajor>> J(jacobians[1]);
      J.setZero();
      J.middleRows<3>(3).diagonal().setConstant(scale_);
    }
    if (jacobians[2] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 51, kHandDofs, Eigen::RowMajor>> J(jacobians[2]);
      J.setZero();
      J.bottomRows<kHandDofs>().diagonal().setConstant(scale_);
    }
    return true;
  }

  /// The energy as the paper writes it, without weight.
  static double Energy(const Eigen::Quaterniond& orientation_prev,
                       const Eigen::Vector3d& translation_prev, const FingerPose& fingers_prev,
                       const Eigen::Quaterniond& orientation, const Eigen::Vector3d& translation,
                       const FingerPose& fingers) {
    return LogSO3((orientation_prev.conjugate() * orientation).toRotationMatrix()).squaredNorm() +
           (translation - translation_prev).squaredNorm() + (fingers - fingers_prev).squaredNorm();
  }

 private:
  Eigen::Quaterniond orientation_;
  Eigen::Vector3d translation_;
  FingerPose fingers_;
  double scale_;
};

/// The fingers' part of E_t alone, for a second hand that holds the same object: 45 residuals,
/// radians. Parameter block: fingers P (45).
class FingerTemporal final : public ceres::SizedCostFunction<kHandDofs, kHandDofs> {
 public:
  FingerTemporal(const FingerPose& fingers, double weight)
      : fingers_(fingers), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    Eigen::Map<FingerPose> r(residuals);
    r = scale_ * (Eigen::Map<const FingerPose>(parameters[0]) - fingers_);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, kHandDofs, kHandDofs, Eigen::RowMajor>> J(jacobians[0]);
      J.setIdentity();
      J *= scale_;
    }
    return true;
  }

 private:
  FingerPose fingers_;
  double scale_;
};

}  // namespace holdfast
