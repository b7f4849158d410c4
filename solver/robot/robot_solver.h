// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "solver/robot/robot_term.h"
#include "solver/unknowns/dense_minimizer.h"

namespace holdfast {

/// Least squares over one pose of a hand: DenseMinimizer (Ceres' Levenberg-Marquardt) on the terms'
/// normal equations. Scratch; the hand must outlive it.
class RobotSolver final : private NormalTerm {
 public:
  explicit RobotSolver(const RobotHand& hand);

  /// Moves `pose` to a minimum of the terms' sum, and its numbers into their bounds.
  DenseMinimizer::Report Solve(const std::vector<const RobotTerm*>& terms,
                               const DenseMinimizer::Options& options, RobotPose& pose);

  /// Cost and derivatives at a pose, by turn, translation and numbers (6 + dofs).
  double Evaluate(const std::vector<const RobotTerm*>& terms, const RobotPose& pose,
                  Eigen::MatrixXd& hessian, Eigen::VectorXd& gradient);

 private:
  std::vector<int> TangentSizes() const override;
  double CostAt(double const* const* parameters) const override;
  void NormalEquations(double const* const* parameters, Eigen::Ref<Eigen::MatrixXd> hessian,
                       Eigen::Ref<Eigen::VectorXd> gradient) const override;
  void Set(double const* const* parameters) const;

  const RobotHand& hand_;
  const std::vector<const RobotTerm*>* terms_ = nullptr;
  mutable RobotPose pose_;
  mutable PosedRobot robot_;
  mutable RobotNormal normal_;
};

}  // namespace holdfast
