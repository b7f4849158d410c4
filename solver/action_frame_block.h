// SPDX-License-Identifier: MIT
#pragma once

#include <ceres/cost_function.h>

#include <Eigen/Core>

#include "solver/reach_chain.h"
#include "solver/terms/balance.h"
#include "solver/terms/gaze.h"
#include "solver/terms/held_at_face.h"
#include "solver/terms/joint_range.h"
#include "solver/terms/leg_reach.h"
#include "solver/terms/trunk_lean.h"

namespace holdfast {

/// All that is asked of a body in one frame of an action.
struct ActionFrameTerms {
  HeldAtFace hand;
  Gaze gaze;
  TrunkLean lean;
  LegReach legs;
  Balance balance;
  JointRange range;
};

/// The terms of one frame as a function of the four control points of a cubic B-spline that its
/// change lies between: x = sum_k basis_k c_k. 26 residuals; parameter blocks: four control points
/// (28 each, ReachDofs). The body is evaluated once for all terms.
class ActionFrameBlock final : public ceres::CostFunction {
 public:
  static constexpr int kRows = HeldAtFace::kRows + Gaze::kRows + TrunkLean::kRows +
                               LegReach::kRows + Balance::kRows + JointRange::kRows;

  /// `chain` and `base` (the frame that is changed) must outlive the block.
  ActionFrameBlock(const ReachChain& chain, const BodyFrame& base, const ActionFrameTerms& terms,
                   const Eigen::Vector4d& basis);

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  const ReachChain& chain_;
  const BodyFrame& base_;
  ActionFrameTerms terms_;
  Eigen::Vector4d basis_;
};

}  // namespace holdfast
