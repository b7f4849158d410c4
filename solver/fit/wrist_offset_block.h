// SPDX-License-Identifier: MIT
#pragma once

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "solver/fit/hand_object_block.h"

namespace holdfast {

/// A HandObjectBlock whose hand may also move as a whole: two wrists that were captured or
/// synthesised never keep exactly the distance that a rigid object between them needs.
///
/// With the wrist's world pose (W, p), the hand's vertices become
///   v' = p + W (C W^T (v - p) + c),
/// C in SO(3) and c (metres) in the wrist's frame. Moving the hand by (C, c) is moving the object
/// by the inverse, so that the block needs no Jacobian of its own beyond a change of variables.
///
/// Parameter blocks: orientation (4), translation (3), fingers (45) as in HandObjectBlock, then C
/// (4, x y z w, with RotationManifold) and c (3). Residuals: 52, those of the block.
class WristOffsetBlock final : public ceres::CostFunction {
 public:
  /// `block` and `state` (the block's own) must outlive this; the state's body must be set.
  WristOffsetBlock(const HandObjectBlock* block, const HandState* state);

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  const HandObjectBlock* block_;
  const HandState* state_;
};

/// The object's pose that looks to the unmoved hand as (q, translation) does to the moved one.
struct RelativePose {
  Eigen::Quaterniond orientation;
  Eigen::Vector3d translation;
};
RelativePose SeenByUnmovedHand(const Eigen::Matrix3d& wrist_rotation,
                               const Eigen::Vector3d& wrist_position, const Eigen::Quaterniond& q,
                               const Eigen::Vector3d& translation,
                               const Eigen::Quaterniond& offset_rotation,
                               const Eigen::Vector3d& offset);

}  // namespace holdfast
