// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>

#include <Eigen/Core>

#include "generator/body/limb_ik.h"
#include "geometry/rotation.h"
#include "solver/clearance/arm_change.h"

namespace holdfast {

/// Elbow and wrist bend no farther than joints bend, or than the clip bends them.
///
///   r_k = (max(0, a_k - highest_k) - max(0, lowest_k - a_k)) / sigma,   3 residuals
///
/// a: elbow flexion about its hinge, wrist flexion, ulnar deviation: components of
/// log(S_j exp(x_j)), radians. x: the arm's change (12). Limits of Limb and WristLimits.
struct ArmRange {
  static constexpr int kRows = 3;
  Eigen::Matrix3d elbow, wrist;     ///< S_j
  Eigen::Matrix3d axes;             ///< columns: elbow's hinge; wrist: flexion, ulnar
  Eigen::Vector3d lowest, highest;  ///< radians
  double sigma_rad = 2.0 * kDegree;

  ArmRange(Side side, const ArmFrame& frame)
      : elbow(frame.local[kArmElbow]), wrist(frame.local[kArmWrist]) {
    const double sign = side == Side::kRight ? 1.0 : -1.0;
    const Limb arm = Arm(side);
    const WristLimits limits;
    axes << arm.hinge, sign * Eigen::Vector3d::UnitZ(), -sign * Eigen::Vector3d::UnitY();
    const Eigen::Vector3d now = Angles(LogSO3(elbow), LogSO3(wrist));
    lowest =
        Eigen::Vector3d(arm.min_flexion_rad, limits.flexion_min, limits.ulnar_min).cwiseMin(now);
    highest =
        Eigen::Vector3d(arm.max_flexion_rad, limits.flexion_max, limits.ulnar_max).cwiseMax(now);
  }

  Eigen::Vector3d Angles(const Eigen::Vector3d& elbow_turn,
                         const Eigen::Vector3d& wrist_turn) const {
    return {axes.col(0).dot(elbow_turn), axes.col(1).dot(wrist_turn), axes.col(2).dot(wrist_turn)};
  }

  template <typename Residuals, typename Jacobian>
  void Evaluate(const ArmChange& change, Residuals&& residuals,
                Jacobian&& J_residuals_change) const {
    const Eigen::Vector3d at_elbow = change.segment<3>(3 * kArmElbow),
                          at_wrist = change.segment<3>(3 * kArmWrist);
    const Eigen::Vector3d elbow_turn = LogSO3(elbow * ExpSO3(at_elbow)),
                          wrist_turn = LogSO3(wrist * ExpSO3(at_wrist));
    const Eigen::Vector3d angles = Angles(elbow_turn, wrist_turn);
    J_residuals_change.setZero();
    for (int k = 0; k < 3; ++k) {
      residuals(k) =
          (std::max(0.0, angles(k) - highest(k)) - std::max(0.0, lowest(k) - angles(k))) /
          sigma_rad;
      if (residuals(k) == 0.0) continue;
      // log(S exp(x + dx)) = log(S exp(x)) + Jr^-1(turn) Jr(x) dx.
      const Eigen::Vector3d& turn = k == 0 ? elbow_turn : wrist_turn;
      J_residuals_change.template block<1, 3>(k, 3 * (k == 0 ? kArmElbow : kArmWrist)) =
          axes.col(k).transpose() * InverseLeftJacobianSO3(-turn) *
          LeftJacobianSO3(k == 0 ? -at_elbow : -at_wrist) / sigma_rad;
    }
  }
};

}  // namespace holdfast
