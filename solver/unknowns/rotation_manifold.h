// SPDX-License-Identifier: MIT
#pragma once

#include <ceres/manifold.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/rotation.h"

namespace holdfast {

/// Unit quaternions (x, y, z, w as in Eigen) as SO(3), updated on the right by a rotation vector in
/// radians: Plus(q, delta) = q exp(delta). The tangent is the full axis-angle, not half of it as in
/// Ceres's own quaternion manifolds, so weights on it have units of radians.
class RotationManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 4; }
  int TangentSize() const override { return 3; }

  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    const Eigen::Map<const Eigen::Quaterniond> q(x);
    const Eigen::Map<const Eigen::Vector3d> w(delta);
    const double half = 0.5 * w.norm();
    const double sinc = half > 1e-4 ? std::sin(half) / half : 1.0 - half * half / 6.0;
    const Eigen::Vector3d v = 0.5 * sinc * w;
    Eigen::Quaterniond step(std::cos(half), v.x(), v.y(), v.z());
    Eigen::Map<Eigen::Quaterniond> result(x_plus_delta);
    result = (q * step).normalized();
    return true;
  }

  bool PlusJacobian(const double* x, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 4, 3, Eigen::RowMajor>> J{jacobian};
    J = PlusJacobianAt(x);
    return true;
  }

  bool Minus(const double* y, const double* x, double* y_minus_x) const override {
    const Eigen::Map<const Eigen::Quaterniond> to(y), from(x);
    Eigen::Quaterniond q = from.conjugate() * to;
    if (q.w() < 0.0) q.coeffs() = -q.coeffs();
    const double s = q.vec().norm();
    const double factor = s > 1e-8 ? 2.0 * std::atan2(s, q.w()) / s : 2.0;
    Eigen::Map<Eigen::Vector3d> difference{y_minus_x};
    difference = factor * q.vec();
    return true;
  }

  bool MinusJacobian(const double* x, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> J{jacobian};
    J = 4.0 * PlusJacobianAt(x).transpose();
    return true;
  }

  /// d (q exp(delta)) / d delta at 0: (4 x 3), columns orthogonal with norm 1/2.
  static Eigen::Matrix<double, 4, 3> PlusJacobianAt(const double* q) {
    Eigen::Matrix<double, 4, 3> J;
    J << q[3], -q[2], q[1],  //
        q[2], q[3], -q[0],   //
        -q[1], q[0], q[3],   //
        -q[0], -q[1], -q[2];
    return 0.5 * J;
  }

  /// Converts a Jacobian by delta (rows x 3) to the one by the four coordinates that Ceres
  /// requires: multiplied by PlusJacobian, it gives the former.
  template <typename Derived>
  static Eigen::Matrix<double, Derived::RowsAtCompileTime, 4, Eigen::RowMajor> Lift(
      const Eigen::MatrixBase<Derived>& J_out_delta, const double* q) {
    return 4.0 * J_out_delta * PlusJacobianAt(q).transpose();
  }
};

/// Fills the Jacobians of six residuals, `scale` times a position and `turn_scale` times a turn (3
/// each), by the pose in parameter blocks `first` (q) and `first` + 1 (T), where requested.
inline void FillPoseJacobians(double const* const* parameters, double** jacobians, int first,
                              double scale, double turn_scale, const Eigen::Matrix3d& d_turn,
                              const Eigen::Matrix3d& d_T) {
  if (jacobians[first] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 6, 4, Eigen::RowMajor>> J(jacobians[first]);
    J.topRows<3>().setZero();
    J.bottomRows<3>() = turn_scale * RotationManifold::Lift(d_turn, parameters[first]);
  }
  if (jacobians[first + 1] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 6, 3, Eigen::RowMajor>> J(jacobians[first + 1]);
    J.topRows<3>() = scale * d_T;
    J.bottomRows<3>().setZero();
  }
}

}  // namespace holdfast
