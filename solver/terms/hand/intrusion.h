// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "solver/hand/hand_evaluation.h"
#include "solver/unknowns/rotation_manifold.h"

namespace holdfast {

/// A place o of the object's surface that is in the hand, and the skin over it: a place of one
/// triangle.
struct Intrusion {
  Eigen::Vector3d point;       ///< o, object's frame, metres
  std::array<int, 3> corners;  ///< vertices of the triangle
  Eigen::Vector3d shares;      ///< of the corners in its place, sum 1
  Eigen::Vector3d outward;     ///< unit, from o to there, frame of the hand
};

/// Edges and thin walls of the object that lie in the hand without a point of the skin inside them
/// (as ObjectInHand, for a few iterations around one pose): the skin goes back over each,
///
///   r_j = w max(0, n_j . (s_j(P) - R o_j - T)),   s_j = sum_k shares_jk x_k(P)
///
/// Parameter blocks: object rotation R (unit quaternion x, y, z, w with RotationManifold), object
/// translation T (3, metres, the frame of the hand), finger pose P (45, radians).
class IntrusionTerm final : public ceres::CostFunction {
 public:
  /// `hand` must outlive the term. `weight` is per metre.
  IntrusionTerm(HandEvaluation& hand, std::vector<Intrusion> intrusions, double weight)
      : hand_(hand), intrusions_(std::move(intrusions)), weight_(weight) {
    set_num_residuals(static_cast<int>(intrusions_.size()));
    *mutable_parameter_block_sizes() = {4, 3, kHandDofs};
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Matrix3d R =
        Eigen::Map<const Eigen::Quaterniond>(parameters[0]).toRotationMatrix();
    const Eigen::Map<const Eigen::Vector3d> T(parameters[1]);
    double* const J_rotation = jacobians ? jacobians[0] : nullptr;
    double* const J_translation = jacobians ? jacobians[1] : nullptr;
    double* const J_fingers = jacobians ? jacobians[2] : nullptr;
    const Eigen::Matrix3Xd& vertices = hand_.At(parameters[2], J_fingers != nullptr).Vertices();
    for (std::size_t j = 0; j < intrusions_.size(); ++j) {
      const Intrusion& in = intrusions_[j];
      Eigen::Vector3d skin = Eigen::Vector3d::Zero();
      for (int k = 0; k < 3; ++k) skin += in.shares[k] * vertices.col(in.corners[k]);
      const double depth = in.outward.dot(skin - R * in.point - T);
      residuals[j] = weight_ * std::max(0.0, depth);
      const Eigen::Vector3d slope =
          depth > 0.0 ? Eigen::Vector3d(weight_ * in.outward) : Eigen::Vector3d::Zero();
      if (J_rotation) {
        // R exp(delta): R o moves by R (delta x o).
        const Eigen::RowVector3d J_delta = -in.point.cross(R.transpose() * slope).transpose();
        Eigen::Map<Eigen::RowVector4d>(J_rotation + 4 * j) =
            RotationManifold::Lift(J_delta, parameters[0]);
      }
      if (J_translation) Eigen::Map<Eigen::RowVector3d>(J_translation + 3 * j) = -slope;
      if (!J_fingers) continue;
      double* const row = J_fingers + kHandDofs * j;
      std::fill(row, row + kHandDofs, 0.0);
      if (depth <= 0.0) continue;
      for (int k = 0; k < 3; ++k) hand_.AddRow(in.corners[k], in.shares[k] * slope, row);
    }
    return true;
  }

 private:
  HandEvaluation& hand_;
  std::vector<Intrusion> intrusions_;
  double weight_;
};

}  // namespace holdfast
