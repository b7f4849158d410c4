// SPDX-License-Identifier: MIT
#pragma once

#include <deque>
#include <functional>

#include <ceres/problem.h>
#include <ceres/solver.h>
#include <Eigen/Core>

#include "solver/latent/latent_options.h"
#include "solver/latent/rollout_cost.h"

namespace holdfast {

/// A baseline's optimizer that takes every step it makes: from the gradient to the next variables,
/// without a look at the objective. All else is minimized by Ceres. `iteration` counts from 0.
class StepRule {
 public:
  virtual ~StepRule() = default;
  virtual const char* Name() const = 0;
  /// False when there is nothing left to gain.
  virtual bool Step(int iteration, const Eigen::VectorXd& gradient, Eigen::VectorXd& variables) = 0;
};

/// Falls linearly from the first iteration to the last.
struct AdamRates {
  double first = 0.05;
  double last_ratio = 0.1;
  int iterations = 200;
  double square_decay = 0.999;  ///< beta_2
  double tiny = 1e-8;           ///< epsilon
};

/// Kingma & Ba 2015, algorithm 1; beta_1 is 0.9.
class Adam final : public StepRule {
 public:
  explicit Adam(const AdamRates& rates) : rates_(rates) {}
  const char* Name() const override { return "ADAM"; }
  bool Step(int iteration, const Eigen::VectorXd& gradient, Eigen::VectorXd& variables) override;

 private:
  AdamRates rates_;
  Eigen::ArrayXd mean_, square_;
};

/// L-BFGS (Nocedal & Wright 2006, algorithm 7.4) that takes every step whole, which no line search
/// of Ceres does; the first as steepest descent of length at most 1 (in the sum of magnitudes). It
/// stops where no entry of the gradient is above 1e-7.
class LbfgsStepOne final : public StepRule {
 public:
  explicit LbfgsStepOne(int history) : history_(static_cast<std::size_t>(history)) {}
  const char* Name() const override { return "LBFGS_STEP_ONE"; }
  bool Step(int iteration, const Eigen::VectorXd& gradient, Eigen::VectorXd& variables) override;

 private:
  struct Pair {
    Eigen::VectorXd step, change;
    double curvature;
  };
  std::size_t history_;
  std::deque<Pair> pairs_;  // the oldest first
  Eigen::VectorXd step_, before_;
};

/// Sees each iterate, the first included, with its motion in the cost; true ends the minimization.
using IterateSeen = std::function<bool(int iteration)>;

/// The problem that all methods solve: latents z (64 T) of one motion, a parameter block a step,
///   min_z 1/2 |r(z)|^2 + lambda/2 sum_t |z_t - c_t|^2,
/// r a RolloutCost, which must be evaluated from its batch, and the prior a LatentPrior a step.
class LatentProblem {
 public:
  LatentProblem(RolloutCost<float>& cost, Eigen::VectorXd center, double prior_weight);

  /// By Ceres, from `latents` on, which it changes.
  LatentSolve Minimize(ceres::Solver::Options options, Eigen::VectorXd& latents,
                       const IterateSeen& seen);
  /// By a rule that takes every step it makes; ends before what is not finite.
  LatentSolve Descend(StepRule& rule, int iterations, Eigen::VectorXd& latents,
                      const IterateSeen& seen);

 private:
  RolloutCost<float>& cost_;
  Eigen::VectorXd center_;
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
