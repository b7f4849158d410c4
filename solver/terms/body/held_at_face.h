// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "solver/unknowns/upper_body_chain.h"

namespace holdfast {

/// The hand is where the world or the head wants it: what is held before the mouth goes where the
/// mouth goes, and the mouth comes to it.
///
///   r = (w(x) - (1 - s) q - s (h(x) + A(x) p)) / sigma,   3 residuals
///
/// w: wrist joint, world; h, A: position and rotation of the head joint; q: place in the world;
/// p: place in the head's frame; s: share of the head's. x: the frame's change (UpperBodyDofs, 28).
/// Metres; `sigma_m` is one standard deviation.
struct HeldAtFace {
  static constexpr int kRows = 3;
  double share = 0.0;
  Eigen::Vector3d in_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d in_head = Eigen::Vector3d::Zero();
  double sigma_m = 0.01;

  template <typename Residuals, typename Jacobian>
  void Evaluate(const UpperBodyChain& chain, const UpperBodyState& state, Residuals&& residuals,
                Jacobian&& J_residuals_change) const {
    constexpr int kHeadJoint = 15;
    const BodyPlacement& placed = state.Placed();
    const int wrist = chain.WristJointId();
    const Eigen::Vector3d from_head = placed.rotation[kHeadJoint] * in_head;
    residuals = (placed.joints.col(wrist) - (1.0 - share) * in_world -
                 share * (placed.joints.col(kHeadJoint) + from_head)) /
                sigma_m;
    J_residuals_change =
        (state.PointJacobian(wrist) -
         share * (state.PointJacobian(kHeadJoint) + state.HeadDirectionJacobian(from_head))) /
        sigma_m;
  }
};

}  // namespace holdfast
