// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/rotation.h"
#include "solver/unknowns/upper_body_chain.h"

namespace holdfast {

/// Joints bend no farther than captured bodies bend them; the elbow between straight and folded.
///
///   r_j = max(0, |log(S_j exp(x_j))| - limit_j) / sigma   8 residuals: spine1, spine2, spine3,
///                                                         collar, shoulder, neck, head, (elbow)
///   r_elbow = (max(0, f - highest) - max(0, lowest - f)) / sigma,  f = captured flexion + x
///
/// x: the frame's change (UpperBodyDofs, 28); radians. Where the capture itself is beyond a limit,
/// the limit is the captured angle: see Of.
struct JointRange {
  static constexpr int kRows = 8;
  static constexpr std::array<int, 7> kColumns = {
      UpperBodyDofs::kSpine,  UpperBodyDofs::kSpine + 3, UpperBodyDofs::kSpine + 6,
      UpperBodyDofs::kCollar, UpperBodyDofs::kShoulder,  UpperBodyDofs::kNeck,
      UpperBodyDofs::kHead};

  std::array<Eigen::Matrix3d, 7> captured;  ///< S_j
  std::array<double, 7> limit;              ///< radians
  double elbow = 0.0;                       ///< captured flexion
  double lowest_elbow = 0.05, highest_elbow = 2.5;
  double sigma_rad = 0.02;

  static std::array<int, 7> Joints(const UpperBodyChain& chain) {
    return {3, 6, 9, chain.CollarJoint(), chain.ShoulderJoint(), 12, 15};
  }

  /// `limits`: greatest angle of each of the 22 joints, radians.
  static JointRange Of(const UpperBodyChain& chain, const BodyFrame& frame,
                       const std::array<double, kNumBodyJoints>& limits) {
    JointRange range;
    const std::array<int, 7> joints = Joints(chain);
    for (std::size_t k = 0; k < joints.size(); ++k) {
      range.captured[k] = frame.local[joints[k]].toRotationMatrix();
      range.limit[k] = std::max(limits[joints[k]], LogSO3(range.captured[k]).norm());
    }
    range.elbow = chain.ElbowFlexion(frame);
    range.lowest_elbow = std::min(range.lowest_elbow, range.elbow);
    range.highest_elbow = std::max(range.highest_elbow, range.elbow);
    return range;
  }

  template <typename Residuals, typename Jacobian>
  void Evaluate(const UpperBodyChain&, const UpperBodyState&, const UpperBodyChange& change,
                Residuals&& residuals, Jacobian&& J_residuals_change) const {
    residuals.setZero();
    J_residuals_change.setZero();
    for (int k = 0; k < 7; ++k) {
      const Eigen::Vector3d x = change.segment<3>(kColumns[static_cast<std::size_t>(k)]);
      const Eigen::Vector3d turn = LogSO3(captured[static_cast<std::size_t>(k)] * ExpSO3(x));
      const double angle = turn.norm();
      const double beyond = angle - limit[static_cast<std::size_t>(k)];
      if (beyond <= 0.0) continue;
      residuals(k) = beyond / sigma_rad;
      // d log(S exp(x)) = Jr^-1(turn) Jr(x) dx, and turn^T Jr^-1(turn) = turn^T.
      J_residuals_change.template block<1, 3>(k, kColumns[static_cast<std::size_t>(k)]) =
          turn.transpose() / (angle * sigma_rad) * LeftJacobianSO3(-x);
    }
    const double flexion = elbow + change(UpperBodyDofs::kElbow);
    residuals(7) =
        (std::max(0.0, flexion - highest_elbow) - std::max(0.0, lowest_elbow - flexion)) /
        sigma_rad;
    J_residuals_change(7, UpperBodyDofs::kElbow) =
        flexion > highest_elbow || flexion < lowest_elbow ? 1.0 / sigma_rad : 0.0;
  }
};

}  // namespace holdfast
