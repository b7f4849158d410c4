// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "solver/unknowns/upper_body_chain.h"

namespace holdfast {

/// The chest leans and turns as it is asked to.
///
///   r = [u(x) - up;  f(x) - forward] / sigma,   6 residuals; u, f: the chest's y and z axes, world
///
/// x: the frame's change (UpperBodyDofs, 28). `up` and `forward` are unit vectors; `sigma` about
/// radians.
struct TrunkLean {
  static constexpr int kRows = 6;
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d forward = -Eigen::Vector3d::UnitY();
  double sigma = 0.1;

  template <typename Residuals, typename Jacobian>
  void Evaluate(const UpperBodyChain&, const UpperBodyState& state, Residuals&& residuals,
                Jacobian&& J_residuals_change) const {
    constexpr int kChestJoint = 9;
    const Eigen::Vector3d u = state.Placed().rotation[kChestJoint].col(1);
    const Eigen::Vector3d f = state.Placed().rotation[kChestJoint].col(2);
    residuals.template head<3>() = (u - up) / sigma;
    residuals.template tail<3>() = (f - forward) / sigma;
    J_residuals_change.template topRows<3>() = state.DirectionJacobian(kChestJoint, u) / sigma;
    J_residuals_change.template bottomRows<3>() = state.DirectionJacobian(kChestJoint, f) / sigma;
  }
};

}  // namespace holdfast
