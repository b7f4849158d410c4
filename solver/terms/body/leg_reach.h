// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>

#include <Eigen/Core>

#include "generator/body/limb_ik.h"
#include "generator/matching/leg_placement.h"
#include "geometry/rotation.h"
#include "solver/unknowns/upper_body_chain.h"

namespace holdfast {

/// The hips stay where the legs reach the ankles, which do not move: neither too far nor folded.
///
///   r_k = max(0, |h_k(x) - a_k| - longest_k) / sigma                 2 residuals (left, right)
///   r_k+2 = max(0, shortest - |h_k(x) - a_k|) / sigma                2 residuals
///
/// x: the frame's change (UpperBodyDofs, 28); metres. `longest` of a frame whose captured leg is
/// straighter than a limit is the captured length.
struct LegReach {
  static constexpr int kRows = 4;
  std::array<Eigen::Vector3d, 2> ankle = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  std::array<double, 2> longest = {0.8, 0.8};
  double shortest = 0.3;
  double sigma_m = 0.004;

  /// Of a captured frame whose feet shall be at `feet`: knees between 4 and 140 degrees bent.
  static LegReach Of(const UpperBodyChain& chain, const BodyPlacement& placed,
                     const FeetTarget& feet) {
    LegReach legs;
    for (const std::size_t k : {0u, 1u}) {
      Limb leg = Leg(k == 0 ? Side::kLeft : Side::kRight);
      leg.min_flexion_rad = 4.0 * kDegree;
      leg.max_flexion_rad = 140.0 * kDegree;
      legs.ankle[k] = feet.ankle[k];
      const double captured = (placed.joints.col(leg.root) - feet.ankle[k]).norm();
      legs.longest[k] = std::max(captured, MaxReach(chain.RestJoints(), leg));
      legs.shortest = MinReach(chain.RestJoints(), leg);
    }
    return legs;
  }

  template <typename Residuals, typename Jacobian>
  void Evaluate(const UpperBodyChain&, const UpperBodyState& state, Residuals&& residuals,
                Jacobian&& J_residuals_change) const {
    for (int k = 0; k < 2; ++k) {
      const int hip = 1 + k;
      const Eigen::Vector3d leg =
          state.Placed().joints.col(hip) - ankle[static_cast<std::size_t>(k)];
      const double length = leg.norm();
      const double beyond = length - longest[static_cast<std::size_t>(k)];
      const double within = shortest - length;
      residuals(k) = std::max(0.0, beyond) / sigma_m;
      residuals(k + 2) = std::max(0.0, within) / sigma_m;
      const Eigen::Matrix<double, 1, UpperBodyDofs::kSize> J_length =
          leg.transpose() / length * state.PointJacobian(hip);
      J_residuals_change.row(k) = (beyond > 0.0 ? 1.0 / sigma_m : 0.0) * J_length;
      J_residuals_change.row(k + 2) = (within > 0.0 ? -1.0 / sigma_m : 0.0) * J_length;
    }
  }
};

}  // namespace holdfast
