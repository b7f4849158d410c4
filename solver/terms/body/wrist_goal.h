// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "solver/unknowns/upper_body_chain.h"

namespace holdfast {

/// The wrist is where a path wants it.
///
///   r = (w(x) - target) / sigma,   3 residuals; w: wrist joint, world, metres
///
/// x: the frame's change (UpperBodyDofs, 28). `sigma_m`: metres that are one standard deviation.
struct WristGoal {
  static constexpr int kRows = 3;
  Eigen::Vector3d target = Eigen::Vector3d::Zero();
  double sigma_m = 0.01;

  template <typename Residuals, typename Jacobian>
  void Evaluate(const UpperBodyChain& chain, const UpperBodyState& state, Residuals&& residuals,
                Jacobian&& J_residuals_change) const {
    const int wrist = chain.WristJointId();
    residuals = (state.Placed().joints.col(wrist) - target) / sigma_m;
    J_residuals_change = state.PointJacobian(wrist) / sigma_m;
  }
};

}  // namespace holdfast
