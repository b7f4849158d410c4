// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <vector>

#include <Eigen/Core>

#include "solver/clearance/arm_change.h"

namespace holdfast {

/// Points of the object, the hand and the forearm keep out of the person's own body, each beyond
/// the plane of the skin nearest to it.
///
///   r_i = max(0, n_i . (s_i - p_i(x)) + margin) / sigma,   one residual a point
///
/// s_i: nearest skin, n_i: unit, out of the body, both held (OwnBody); p_i: the point, world,
/// metres, which goes along with the wrist or, on the forearm, partly with the elbow. x: the arm's
/// change (12). Linear in p: planes are taken anew where the arm has got to.
struct DepthInBody {
  struct Plane {
    Eigen::Vector3d in_elbow, in_wrist;  ///< the point, metres
    double wrist_share;                  ///< 1: fixed to the wrist
    Eigen::Vector3d surface, normal;
  };
  std::vector<Plane> planes;
  double margin_m = 0.003;
  double sigma_m = 0.001;

  int Rows() const { return static_cast<int>(planes.size()); }

  template <typename Residuals, typename Jacobian>
  void Evaluate(const ArmState& state, Residuals&& residuals, Jacobian&& J_residuals_change) const {
    for (int i = 0; i < Rows(); ++i) {
      const Plane& plane = planes[i];
      const Eigen::Vector3d by_wrist = state.WorldFrom(kArmWrist) * plane.in_wrist;
      const Eigen::Vector3d by_elbow = state.WorldFrom(kArmElbow) * plane.in_elbow;
      const Eigen::Vector3d point =
          plane.wrist_share * by_wrist + (1.0 - plane.wrist_share) * by_elbow;
      const double within = plane.normal.dot(plane.surface - point) + margin_m;
      residuals(i) = std::max(0.0, within) / sigma_m;
      J_residuals_change.row(i).setZero();
      if (within <= 0.0) continue;
      const Eigen::RowVector3d slope = -plane.normal.transpose() / sigma_m;
      J_residuals_change.row(i) =
          plane.wrist_share * slope * state.PointJacobian(kArmWrist, by_wrist);
      if (plane.wrist_share < 1.0) {
        J_residuals_change.row(i) +=
            (1.0 - plane.wrist_share) * slope * state.PointJacobian(kArmElbow, by_elbow);
      }
    }
  }
};

}  // namespace holdfast
