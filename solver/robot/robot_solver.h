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

/// Terms of one robot hand pose as a Ceres cost function: their exact sum, compressed to one row
/// more than the number of unknowns.
///
/// Parameter blocks: orientation q (4; x y z w; root to object, with RotationManifold), translation
/// T (3, meters, object's frame), joint values (dofs; radians or meters). Evaluate returns false if
/// the cost is not finite. Not thread-safe; the hand must outlive it.
class RobotBlock final : public ceres::CostFunction {
 public:
  explicit RobotBlock(const RobotHand& hand);
  /// Sets the terms to sum; they must outlive their use.
  void SetTerms(std::vector<const RobotTerm*> terms) { terms_ = std::move(terms); }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

  /// Cost and derivatives at a pose with respect to rotation, translation and joints (6 + dofs).
  double Linearize(const RobotPose& pose, Eigen::MatrixXd& hessian,
                   Eigen::VectorXd& gradient) const;

  /// Moves `pose` to a minimum of the sum of `terms` (ceres::Solve) and clamps its joint values.
  ceres::Solver::Summary Solve(const std::vector<const RobotTerm*>& terms,
                               const ceres::Solver::Options& options, RobotPose& pose);

 private:
  std::vector<const RobotTerm*> terms_;
  mutable PosedRobot robot_;
  mutable RobotNormal normal_;
  mutable RobotPose pose_;
  mutable Eigen::MatrixXd hessian_;
  mutable Eigen::VectorXd gradient_, rows_residuals_;
  mutable RowMajorMatrix rows_;
};

/// Returns human_wrist_from_root with the robot's palm aligned with the human's (knuckles and
/// axes): the pose of a robot hand that follows the human wrist.
Eigen::Isometry3d WristFromRoot(const HandAxes& axes, const RobotAnatomy& anatomy);

/// Returns start poses: the palm on the human's and tilted, with and without retraction from the
/// object, and fingers straight, half bent and nearly closed.
std::vector<RobotPose> RobotStarts(const HumanFrame& frame,
                                   const Eigen::Isometry3d& wrist_from_root,
                                   const RobotAnatomy& anatomy);

/// Returns start poses that lay the pads on the frame's contacts, for fingers open to nearly
/// closed: the rigid motion by iterated closest points (with normals). Empty without contacts.
std::vector<RobotPose> ContactStarts(const RobotTransferSetup& setup, const HumanFrame& frame);

/// Selects the optimized start with minimum cost (1 + give / 20 mm), among those that cost at most
/// three times the minimum, and returns its index. The give is the object's displacement in the
/// grasp under its own weight (GiveInRobot_m).
int ChooseStart(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                const std::vector<double>& costs);

}  // namespace holdfast
