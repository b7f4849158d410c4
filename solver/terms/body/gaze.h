// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "solver/unknowns/upper_body_chain.h"

namespace holdfast {

/// The head turns with what the hand goes to: as far off the goal as the captured head was off the
/// captured one.
///
///   r = (f(x) - wanted) / sigma,   3 residuals; f: where the face points, world, unit
///
/// x: the frame's change (UpperBodyDofs, 28). `wanted` is a unit vector; `sigma` about radians.
struct Gaze {
  static constexpr int kRows = 3;
  Eigen::Vector3d wanted = -Eigen::Vector3d::UnitY();
  double sigma = 0.3;

  template <typename Residuals, typename Jacobian>
  void Evaluate(const UpperBodyChain&, const UpperBodyState& state, Residuals&& residuals,
                Jacobian&& J_residuals_change) const {
    constexpr int kHeadJoint = 15;
    const Eigen::Vector3d face = state.Placed().rotation[kHeadJoint].col(2);
    residuals = (face - wanted) / sigma;
    J_residuals_change = state.HeadDirectionJacobian(face) / sigma;
  }
};

}  // namespace holdfast
