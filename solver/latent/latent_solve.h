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

/// A baseline optimizer that accepts every step: computes the next variables from the gradient
/// without evaluating the objective. All else is minimized by Ceres. `iteration` starts at 0.
class StepRule {
 public:
  virtual ~StepRule() = default;
  virtual const char* Name() const = 0;
  /// Returns false on convergence.
  virtual bool Step(int iteration, const Eigen::VectorXd& gradient, Eigen::VectorXd& variables) = 0;
};

/// Learning rate, decreasing linearly from the first iteration to the last.
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

/// L-BFGS (Nocedal & Wright 2006, algorithm 7.4) with unit steps, which no line search of Ceres
/// provides; the first step is steepest descent of L1 length at most 1. Stops when no entry of the
/// gradient exceeds 1e-7.
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
  std::deque<Pair> pairs_;  // oldest first
  Eigen::VectorXd step_, before_;
};

/// Called for each iterate, including the first, with its motion in the cost; true terminates.
using IterateSeen = std::function<bool(int iteration)>;

/// The optimization problem: latents z (64 T) of one motion, one parameter block per step,
///   min_z 1/2 |r(z)|^2 + lambda/2 sum_t |z_t - c_t|^2,
/// where r is a RolloutCost, which must be evaluated from its batch; one LatentPrior per step.
class LatentProblem {
 public:
  LatentProblem(RolloutCost<float>& cost, Eigen::VectorXd center, double prior_weight);

  /// Minimizes with Ceres, starting from `latents`, which are updated.
  LatentSolve Minimize(ceres::Solver::Options options, Eigen::VectorXd& latents,
                       const IterateSeen& seen);
  /// Applies a rule that accepts every step; stops before non-finite values.
  LatentSolve Descend(StepRule& rule, int iterations, Eigen::VectorXd& latents,
                      const IterateSeen& seen);

 private:
  RolloutCost<float>& cost_;
  Eigen::VectorXd center_;
  double prior_weight_;
};

/// Appends an iterate to the trace: distance of the joint from the goal, and elapsed time.
void Record(const MotionView& motion, int joint, const Eigen::Vector3d& goal, float seconds,
            ReachTrace& trace);

/// Levenberg-Marquardt with CGNR. J is short and wide: J^T J + D is diagonal plus a matrix whose
/// rank is at most the rows of r, so conjugate gradients converge in a few products. `radius`:
/// initial trust region radius; a larger one allows a longer first step.
ceres::Solver::Options LevenbergMarquardtOptions(int iterations, double radius);
/// L-BFGS with a line search for the strong Wolfe conditions.
ceres::Solver::Options LbfgsOptions(int iterations, int history);

}  // namespace holdfast
