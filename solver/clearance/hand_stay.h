// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/rotation.h"
#include "solver/clearance/arm_change.h"

namespace holdfast {

/// The hand, and with it the object, stays where the clip has it and as upright, and goes no
/// farther than it may.
///
///   r = [(p(x) - p_0) / sigma_m;  log(R(x) R_0^T) / sigma_rad;
///        max(0, |p(x) - p_0| - most) / sigma_most],   7 residuals, world
///
/// (R, p): the wrist's pose, metres; (R_0, p_0) the clip's. x: the arm's change (12). sigma_rad is
/// of each axis: about z, the vertical, an object turns without being spilled.
struct HandStay {
  static constexpr int kRows = 7;
  Eigen::Isometry3d wrist = Eigen::Isometry3d::Identity();  ///< (R_0, p_0)
  double sigma_m = 0.03;
  Eigen::Vector3d sigma_rad = Eigen::Vector3d::Constant(8.0 * kDegree);
  double most_m = 0.1, sigma_most_m = 0.002;

  template <typename Residuals, typename Jacobian>
  void Evaluate(const ArmState& state, Residuals&& residuals, Jacobian&& J_residuals_change) const {
    const Eigen::Isometry3d& now = state.WorldFrom(kArmWrist);
    const Eigen::Vector3d turn = LogSO3(now.linear() * wrist.linear().transpose());
    const Eigen::Vector3d shift = now.translation() - wrist.translation();
    const double distance = shift.norm();
    const J_point_arm J_shift = state.PointJacobian(kArmWrist, now.translation());
    residuals.template head<3>() = shift / sigma_m;
    residuals.template segment<3>(3) = turn.cwiseQuotient(sigma_rad);
    residuals(6) = std::max(0.0, distance - most_m) / sigma_most_m;
    J_residuals_change.template topRows<3>() = J_shift / sigma_m;
    J_residuals_change.template middleRows<3>(3) = sigma_rad.cwiseInverse().asDiagonal() *
                                                   InverseLeftJacobianSO3(turn) *
                                                   state.TurnJacobian(kArmWrist);
    J_residuals_change.row(6).setZero();
    if (distance <= most_m) return;
    J_residuals_change.row(6) = shift.transpose() / (distance * sigma_most_m) * J_shift;
  }
};

}  // namespace holdfast
