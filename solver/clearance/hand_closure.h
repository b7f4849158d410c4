// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/rotation.h"
#include "solver/clearance/arm_change.h"

namespace holdfast {

/// Two hands that hold one rigid object stay as they are to each other: the left wrist is where the
/// right one carries it.
///
///   (R, p) = W_right(x) C,   r = [(p_left(y) - p) / sigma_m;  log(R_left(y) R^T) / sigma_rad]
///
/// 6 residuals, world. C: the left wrist in the right one's frame, as the clip has it, metres; x,
/// y: the changes of the right and the left arm (12 each).
struct HandClosure {
  static constexpr int kRows = 6;
  Eigen::Isometry3d right_from_left = Eigen::Isometry3d::Identity();  ///< C
  double sigma_m = 2e-4;
  double sigma_rad = 1e-3;

  template <typename Residuals, typename Jacobian>
  void Evaluate(const ArmState& right, const ArmState& left, Residuals&& residuals,
                Jacobian&& J_residuals_right, Jacobian&& J_residuals_left) const {
    const Eigen::Isometry3d carried = right.WorldFrom(kArmWrist) * right_from_left;
    const Eigen::Isometry3d& now = left.WorldFrom(kArmWrist);
    const Eigen::Vector3d turn = LogSO3(now.linear() * carried.linear().transpose());
    residuals.template head<3>() = (now.translation() - carried.translation()) / sigma_m;
    residuals.template tail<3>() = turn / sigma_rad;
    // R_left R^T turns by w_left - (R_left R^T) w_right to the left.
    const Eigen::Matrix3d inverse = InverseLeftJacobianSO3(turn) / sigma_rad;
    J_residuals_left.template topRows<3>() =
        left.PointJacobian(kArmWrist, now.translation()) / sigma_m;
    J_residuals_left.template bottomRows<3>() = inverse * left.TurnJacobian(kArmWrist);
    J_residuals_right.template topRows<3>() =
        -right.PointJacobian(kArmWrist, carried.translation()) / sigma_m;
    J_residuals_right.template bottomRows<3>() =
        -inverse * now.linear() * carried.linear().transpose() * right.TurnJacobian(kArmWrist);
  }
};

}  // namespace holdfast
