// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <ceres/cost_function.h>
#include <ceres/solver.h>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "solver/hand/hand_axes.h"
#include "solver/robot/human_demonstration.h"
#include "solver/robot/robot_anatomy.h"
#include "solver/robot/robot_term.h"
#include "solver/robot/transfer_to_robot.h"
#include "solver/unknowns/dense_problem.h"

namespace holdfast {

/// Terms of one pose of a robot hand as a cost function of Ceres: their exact sum, compressed to
/// one row more than there are unknowns.
///
/// Parameter blocks: orientation q (4; x y z w; root to object, with RotationManifold), translation
/// T (3, meters, object's frame), the hand's numbers (dofs; radians or meters). Evaluate returns
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

/// human_wrist_from_root: the robot's palm laid on the human's, knuckles on knuckles, axes along
/// axes. Where a robot's hand is that follows the human wrist.
Eigen::Isometry3d WristFromRoot(const HandAxes& axes, const RobotHand& robot,
                                const RobotAnatomy& anatomy);

/// Poses to begin from: the palm on the human's and tilted, drawn back from the object and not,
/// fingers straight, half bent and nearly closed.
std::vector<RobotPose> RobotStarts(const HumanFrame& frame,
                                   const Eigen::Isometry3d& wrist_from_root, const RobotHand& robot,
                                   const RobotAnatomy& anatomy);

/// Which of the poses that the starts led to is taken: the least of cost (1 + give / 20 mm), of
/// those that cost at most three times the least. The give is how far the object's own weight moves
/// it in that grip (RobotHold). Returns its index.
int ChooseStart(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                const std::vector<double>& costs);

}  // namespace holdfast
