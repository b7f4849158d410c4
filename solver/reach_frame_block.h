// SPDX-License-Identifier: MIT
#pragma once

#include <array>

#include <ceres/cost_function.h>

#include <Eigen/Core>

#include "solver/reach_chain.h"
#include "solver/terms/balance.h"
#include "solver/terms/gaze.h"
#include "solver/terms/joint_range.h"
#include "solver/terms/leg_reach.h"
#include "solver/terms/wrist_goal.h"

namespace holdfast {

/// All that is asked of one frame of a reach.
struct ReachFrameTerms {
  WristGoal wrist;
  Gaze gaze;
  LegReach legs;
  Balance balance;
  JointRange range;
};

/// The terms of one frame as a function of the four control points of a cubic B-spline that its
/// change lies between: x = sum_k basis_k c_k. 20 residuals; parameter blocks: four control points
/// (28 each, ReachDofs). The body is evaluated once for all terms.
class ReachFrameBlock final : public ceres::CostFunction {
 public:
  static constexpr int kRows =
      WristGoal::kRows + Gaze::kRows + LegReach::kRows + Balance::kRows + JointRange::kRows;

  /// `chain` and `captured` must outlive the block.
  ReachFrameBlock(const ReachChain& chain, const BodyFrame& captured, const ReachFrameTerms& terms,
                  const Eigen::Vector4d& basis);

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  const ReachChain& chain_;
  const BodyFrame& captured_;
  ReachFrameTerms terms_;
  Eigen::Vector4d basis_;
};

/// Control points stay small and change little from one to the next:
///
///   r = [c_1 / sigma;  (c_0 - 2 c_1 + c_2) / (bend sigma)],   56 residuals
///
/// Parameter blocks: c_0, c_1, c_2 (28 each). `sigma`: per degree of freedom, metres or radians.
class ReachSplinePrior final : public ceres::CostFunction {
 public:
  ReachSplinePrior(const ReachChange& sigma, double bend);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  ReachChange sigma_;
  double bend_;
};

}  // namespace holdfast
