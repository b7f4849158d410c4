// SPDX-License-Identifier: MIT
#pragma once

#include <functional>

#include <ceres/problem.h>
#include <ceres/solver.h>

#include <Eigen/Core>

#include "solver/latent/reach_task.h"
#include "solver/latent/rollout_cost.h"
#include "solver/latent/step_rule.h"

namespace holdfast {

/// Sees each iterate, the first included, with its motion in the cost; true ends the minimization.
using IterateSeen = std::function<bool(int iteration)>;

/// The problem that all methods solve: latents z (64 T) of one motion, a parameter block a step,
///   min_z 1/2 |r(z)|^2 + lambda/2 sum_t |z_t - c_t|^2,
/// r a RolloutCost, which must be evaluated from its batch, and the prior a LatentPrior a step.
class LatentProblem {
 public:
  LatentProblem(RolloutCost<float>& cost, Eigen::VectorXd centre, double prior_weight);

  /// By Ceres, from `latents` on, which it changes.
  LatentSolve Minimise(ceres::Solver::Options options, Eigen::VectorXd& latents,
                       const IterateSeen& seen);
  /// By a rule that takes every step it makes; ends before what is not finite.
  LatentSolve Descend(StepRule& rule, int iterations, Eigen::VectorXd& latents,
                      const IterateSeen& seen);

 private:
  RolloutCost<float>& cost_;
  Eigen::VectorXd centre_;
  double prior_weight_;
};

/// Adds an iterate: how far the joint is from the goal, and when.
void Record(const MotionView& motion, int joint, const Eigen::Vector3d& goal, float seconds,
            ReachTrace& trace);

/// Levenberg-Marquardt with CGNR. J is short and wide: J^T J + D is diagonal but for as many ranks
/// as r has rows, so that conjugate gradients end after a few products. `radius`: of the trust
/// region at first; the larger, the longer the first step.
ceres::Solver::Options LevenbergMarquardtOptions(int iterations, double radius);
/// L-BFGS with a line search for the strong Wolfe conditions.
ceres::Solver::Options LbfgsOptions(int iterations, int history);

}  // namespace holdfast
