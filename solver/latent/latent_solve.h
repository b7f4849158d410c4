// SPDX-License-Identifier: MIT
#pragma once

#include <deque>
#include <functional>
#include <string>

#include <ceres/problem.h>
#include <ceres/solver.h>
#include <Eigen/Core>

#include "solver/latent/latent_options.h"
#include "solver/latent/rollout_cost.h"

namespace holdfast {

/// A baseline optimizer that accepts every step: computes the next variables from the gradient
/// without evaluating the objective. All else is minimized by Ceres. `iteration` starts at 0.
/// Returns false on convergence.
using StepRule =
    std::function<bool(int iteration, const Eigen::VectorXd& gradient, Eigen::VectorXd& variables)>;

/// Kingma & Ba 2015, algorithm 1, with a learning rate that decreases linearly from the first
/// iteration to the last; beta_1 is 0.9, beta_2 0.999, epsilon 1e-8.
class Adam {
 public:
  /// `last_ratio`: of the last rate to the first.
  Adam(double first_rate, double last_ratio, int iterations)
      : first_rate_(first_rate), last_ratio_(last_ratio), iterations_(iterations) {}
  bool operator()(int iteration, const Eigen::VectorXd& gradient, Eigen::VectorXd& variables);

 private:
  double first_rate_, last_ratio_;
  int iterations_;
  Eigen::ArrayXd mean_, square_;
};

/// L-BFGS (Nocedal & Wright 2006, algorithm 7.4) with unit steps, which no line search of Ceres
/// provides; the first step is steepest descent of L1 length at most 1. Stops when no entry of the
/// gradient exceeds 1e-7.
class LbfgsStepOne {
 public:
  explicit LbfgsStepOne(int history) : history_(static_cast<std::size_t>(history)) {}
  bool operator()(int iteration, const Eigen::VectorXd& gradient, Eigen::VectorXd& variables);

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

/// Minimizes over the latents z (64 T) of one motion, one parameter block per step,
///   min_z 1/2 |r(z)|^2 + lambda/2 sum_t |z_t - c_t|^2,
/// with Ceres, starting from `latents`, which are updated. r is a RolloutCost, which must be
/// evaluated from its batch; one NearPoint per step, of this `center` and `prior_weight`.
LatentSolve MinimizeLatents(RolloutCost<float>& cost, const Eigen::VectorXd& center,
                            double prior_weight, ceres::Solver::Options options,
                            Eigen::VectorXd& latents, const IterateSeen& seen);

/// Same, without prior center, by a rule that accepts every step; stops before non-finite values.
LatentSolve DescendLatents(const std::string& name, const StepRule& rule, int iterations,
                           const RolloutCost<float>& cost, double prior_weight,
                           Eigen::VectorXd& latents, const IterateSeen& seen);

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
