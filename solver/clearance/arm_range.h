// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>

#include <Eigen/Core>

#include "generator/body/limb_ik.h"
#include "geometry/rotation.h"
#include "solver/clearance/arm_change.h"

namespace holdfast {

/// Elbow and wrist bend and twist no farther than joints do, or than the clip has them.
///
///   r_k = (max(0, a_k - highest_k) - max(0, lowest_k - a_k)) / sigma,   4 residuals
///
/// a: elbow flexion about its hinge, wrist flexion, ulnar deviation, twist of the forearm (of elbow
/// and wrist together): components of log(S_j exp(x_j)), radians. x: the arm's change (12). Limits
/// of Limb and WristLimits.
struct ArmRange {
  static constexpr int kRows = 4;
  Eigen::Matrix3d elbow, wrist;     ///< S_j
  Eigen::Matrix3d axes;             ///< columns: elbow's hinge; wrist: flexion, ulnar
  Eigen::Vector4d lowest, highest;  ///< radians
  double sigma_rad = 2.0 * kDegree;

  ArmRange(Side side, const ArmFrame& frame)
      : elbow(frame.local[kArmElbow]), wrist(frame.local[kArmWrist]) {
    const double sign = side == Side::kRight ? 1.0 : -1.0;
    const Limb arm = Arm(side);
    const WristLimits limits;
    axes << arm.hinge, sign * Eigen::Vector3d::UnitZ(), -sign * Eigen::Vector3d::UnitY();
    const Eigen::Vector4d now = Angles(LogSO3(elbow), LogSO3(wrist));
    lowest = Eigen::Vector4d(arm.min_flexion_rad, limits.flexion_min, limits.ulnar_min,
                             -limits.twist_max)
                 .cwiseMin(now);
    highest =
        Eigen::Vector4d(arm.max_flexion_rad, limits.flexion_max, limits.ulnar_max, limits.twist_max)
            .cwiseMax(now);
  }

  Eigen::Vector4d Angles(const Eigen::Vector3d& elbow_turn,
                         const Eigen::Vector3d& wrist_turn) const {
    return {axes.col(0).dot(elbow_turn), axes.col(1).dot(wrist_turn), axes.col(2).dot(wrist_turn),
            elbow_turn.x() + wrist_turn.x()};
  }

  template <typename Residuals, typename Jacobian>
  void Evaluate(const ArmChange& change, Residuals&& residuals,
                Jacobian&& J_residuals_change) const {
    const Eigen::Vector3d at_elbow = change.segment<3>(3 * kArmElbow),
                          at_wrist = change.segment<3>(3 * kArmWrist);
    const Eigen::Vector3d elbow_turn = LogSO3(elbow * ExpSO3(at_elbow)),
                          wrist_turn = LogSO3(wrist * ExpSO3(at_wrist));
    const Eigen::Vector4d angles = Angles(elbow_turn, wrist_turn);
    J_residuals_change.setZero();
    for (int k = 0; k < kRows; ++k) {
      residuals(k) =
          (std::max(0.0, angles(k) - highest(k)) - std::max(0.0, lowest(k) - angles(k))) /
          sigma_rad;
      if (residuals(k) == 0.0) continue;
      // log(S exp(x + dx)) = log(S exp(x)) + Jr^-1(turn) Jr(x) dx.
      const Eigen::Vector3d axis = k < 3 ? Eigen::Vector3d(axes.col(k)) : Eigen::Vector3d::UnitX();
      if (k == 0 || k == 3) {
        J_residuals_change.template block<1, 3>(k, 3 * kArmElbow) =
            axis.transpose() * InverseLeftJacobianSO3(-elbow_turn) * LeftJacobianSO3(-at_elbow) /
            sigma_rad;
      }
      if (k > 0) {
        J_residuals_change.template block<1, 3>(k, 3 * kArmWrist) =
            axis.transpose() * InverseLeftJacobianSO3(-wrist_turn) * LeftJacobianSO3(-at_wrist) /
            sigma_rad;
      }
    }
  }
};

}  // namespace holdfast
