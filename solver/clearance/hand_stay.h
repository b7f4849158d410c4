// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/rotation.h"
#include "solver/clearance/arm_change.h"

namespace holdfast {

/// The hand, and with it the object, stays where the clip has it and as upright.
///
///   r = [(p(x) - p_0) / sigma_m;  log(R(x) R_0^T) / sigma_rad],   6 residuals, world
///
/// (R, p): the wrist's pose, metres; (R_0, p_0) the clip's. x: the arm's change (12).
struct HandStay {
  static constexpr int kRows = 6;
  Eigen::Isometry3d wrist = Eigen::Isometry3d::Identity();  ///< (R_0, p_0)
  double sigma_m = 0.03;
  double sigma_rad = 8.0 * kDegree;

  template <typename Residuals, typename Jacobian>
  void Evaluate(const ArmState& state, Residuals&& residuals, Jacobian&& J_residuals_change) const {
    const Eigen::Isometry3d& now = state.WorldFrom(kArmWrist);
    const Eigen::Vector3d turn = LogSO3(now.linear() * wrist.linear().transpose());
    residuals.template head<3>() = (now.translation() - wrist.translation()) / sigma_m;
    residuals.template tail<3>() = turn / sigma_rad;
    J_residuals_change.template topRows<3>() =
        state.PointJacobian(kArmWrist, now.translation()) / sigma_m;
    J_residuals_change.template bottomRows<3>() =
        InverseLeftJacobianSO3(turn) * state.TurnJacobian(kArmWrist) / sigma_rad;
  }
};

}  // namespace holdfast
