// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <ceres/cost_function.h>
#include <ceres/solver.h>

#include "solver/robot/robot_term.h"
#include "solver/unknowns/dense_problem.h"

namespace holdfast {

/// Terms of one pose of a robot hand as a cost function of Ceres: their exact sum, compressed to
/// one row more than there are unknowns.
///
/// Parameter blocks: orientation q (4; x y z w; root to object, with RotationManifold), translation
/// T (3, metres, object's frame), the hand's numbers (dofs; radians or metres). Evaluate returns
/// false when the cost is not finite. For one thread at a time; the hand must outlive it.
class RobotBlock final : public ceres::CostFunction {
 public:
  explicit RobotBlock(const RobotHand& hand);
  /// Terms to be summed from now on; they must outlive their use.
  void SetTerms(std::vector<const RobotTerm*> terms) { terms_ = std::move(terms); }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

  /// Cost and derivatives at a pose, by turn, translation and numbers (6 + dofs).
  double Linearize(const RobotPose& pose, Eigen::MatrixXd& hessian,
                   Eigen::VectorXd& gradient) const;

 private:
  std::vector<const RobotTerm*> terms_;
  mutable PosedRobot robot_;
  mutable RobotNormal normal_;
  mutable RobotPose pose_;
  mutable Eigen::MatrixXd hessian_;
  mutable Eigen::VectorXd gradient_, rows_residuals_;
  mutable RowMajorMatrix rows_;
};

/// Least squares over one pose of a hand by ceres::Solve. The hand must outlive it.
class RobotSolver {
 public:
  explicit RobotSolver(const RobotHand& hand) : hand_(hand), block_(hand) {}

  /// Moves `pose` to a minimum of the terms' sum, and its numbers into their bounds.
  ceres::Solver::Summary Solve(const std::vector<const RobotTerm*>& terms,
                               const ceres::Solver::Options& options, RobotPose& pose);

 private:
  const RobotHand& hand_;
  RobotBlock block_;
};

}  // namespace holdfast
