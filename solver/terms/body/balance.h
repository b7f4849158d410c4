// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <utility>

#include <Eigen/Core>

#include "solver/unknowns/upper_body_chain.h"

namespace holdfast {

/// The body's weight stays over the feet as it was in the capture, bent as it may be.
///
///   r = (c(x) - captured) / sigma,   2 residuals (ground plane)
///
/// c: the middle of trunk, head and reaching arm, weighed by their share of an adult's mass (de
/// Leva 1996; the legs, which follow, count with the pelvis by half). x: the frame's change
/// (UpperBodyDofs, 28); metres.
struct Balance {
  static constexpr int kRows = 2;
  Eigen::Vector2d captured = Eigen::Vector2d::Zero();
  double sigma_m = 0.04;

  /// Joints and weights, of sum 1.
  static std::array<std::pair<int, double>, 5> Masses(const UpperBodyChain& chain) {
    return {{{0, 0.42},
             {9, 0.38},
             {15, 0.10},
             {chain.ElbowJoint(), 0.06},
             {chain.WristJointId(), 0.04}}};
  }
  static Eigen::Vector2d Middle(const UpperBodyChain& chain, const BodyPlacement& placed) {
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    for (const auto& [joint, weight] : Masses(chain)) {
      middle += weight * placed.joints.col(joint).head<2>();
    }
    return middle;
  }

  template <typename Residuals, typename Jacobian>
  void Evaluate(const UpperBodyChain& chain, const UpperBodyState& state, Residuals&& residuals,
                Jacobian&& J_residuals_change) const {
    residuals = (Middle(chain, state.Placed()) - captured) / sigma_m;
    J_residuals_change.setZero();
    for (const auto& [joint, weight] : Masses(chain)) {
      const J_point_change J_point = state.PointJacobian(joint);
      J_residuals_change += weight / sigma_m * J_point.topRows<2>();
    }
  }
};

}  // namespace holdfast
