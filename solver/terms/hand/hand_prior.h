// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <numbers>

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>

#include "solver/hand/hand_axes.h"

namespace holdfast {

/// Weights of HandPriorTerm, all per radian.
struct HandPriorWeights {
  double limits = 10.0;     ///< an angle beyond its range
  double coupling = 0.5;    ///< last joint away from 2/3 of the middle one
  double neighbours = 1.0;  ///< finger roots whose flexions differ by more than 50 degrees
  double stay = 0.2;        ///< any angle away from the preferred pose
  double spread = 0.0;      ///< in addition, spread and twist away from it
};

/// What fingers do by themselves. With angles a = HandAxes::AnglesOf(P), 97 residuals:
///
///   45  w_limits  (a - clamp(a))
///    4  w_coupling ((a_dip + rest_dip) - 2/3 (a_pip + rest_pip))    fingers, not the thumb
///    3  w_neighbours hinge(|a_mcp - a_mcp'| - 50 deg)               index-middle-ring-pinky
///   45  w_stay (+ w_spread for rows 1 and 2)  (a - preferred)
///
/// Parameter block: finger pose P (45, radians).
class HandPriorTerm final : public ceres::SizedCostFunction<97, kHandDofs> {
 public:
  /// `axes` must outlive the term.
  HandPriorTerm(const HandAxes& axes, const HandAngles& preferred, const HandPriorWeights& weights)
      : axes_(axes), preferred_(preferred), weights_(weights) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const HandAngles angles = axes_.AnglesOf(Eigen::Map<const FingerPose>(parameters[0]));
    Eigen::Map<Eigen::Matrix<double, 97, kHandDofs, Eigen::RowMajor>> J(
        jacobians && jacobians[0] ? jacobians[0] : nullptr);
    const bool with_jacobian = jacobians && jacobians[0];
    if (with_jacobian) J.setZero();
    // One angle's axis is its row of the Jacobian.
    const auto add = [&](int row, double scale, int angle_row, int joint) {
      if (with_jacobian) {
        J.block<1, 3>(row, 3 * joint) += scale * axes_.Axes(joint).col(angle_row).transpose();
      }
    };

    int row = 0;
    for (int k = 0; k < kJointsPerHand; ++k) {
      for (int c = 0; c < 3; ++c, ++row) {
        const AngleRange& range = axes_.Range(c, k);
        const double excess = angles(c, k) - std::clamp(angles(c, k), range.low, range.high);
        residuals[row] = weights_.limits * excess;
        if (excess != 0.0) add(row, weights_.limits, c, k);
      }
    }
    for (int finger = 0; finger < kNumFingers; ++finger) {
      if (finger == kThumb) continue;
      const int pip = 3 * finger + 1, dip = 3 * finger + 2;
      residuals[row] = weights_.coupling * (angles(0, dip) + axes_.RestFlexion(dip) -
                                            2.0 / 3.0 * (angles(0, pip) + axes_.RestFlexion(pip)));
      add(row, weights_.coupling, 0, dip);
      add(row, -2.0 / 3.0 * weights_.coupling, 0, pip);
      ++row;
    }
    constexpr int kNeighbours[4] = {3 * kIndex, 3 * kMiddle, 3 * kRing, 3 * kPinky};
    constexpr double kComfortable = 50.0 * std::numbers::pi / 180.0;
    for (int n = 0; n < 3; ++n, ++row) {
      const int a = kNeighbours[n], b = kNeighbours[n + 1];
      const double difference = angles(0, a) - angles(0, b);
      const double excess = difference - std::clamp(difference, -kComfortable, kComfortable);
      residuals[row] = weights_.neighbours * excess;
      if (excess != 0.0) {
        add(row, weights_.neighbours, 0, a);
        add(row, -weights_.neighbours, 0, b);
      }
    }
    for (int k = 0; k < kJointsPerHand; ++k) {
      for (int c = 0; c < 3; ++c, ++row) {
        const double weight = weights_.stay + (c > 0 ? weights_.spread : 0.0);
        residuals[row] = weight * (angles(c, k) - preferred_(c, k));
        add(row, weight, c, k);
      }
    }
    return true;
  }

 private:
  const HandAxes& axes_;
  HandAngles preferred_;
  HandPriorWeights weights_;
};

}  // namespace holdfast
