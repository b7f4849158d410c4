// SPDX-License-Identifier: MIT
#include "solver/latent/latent_solve.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <ranges>
#include <utility>
#include <vector>

#include <ceres/iteration_callback.h>

#include "solver/terms/motion/goal_terms.h"
#include "solver/unknowns/ceres_solve.h"

namespace holdfast {
namespace {

class SeeIterates final : public ceres::IterationCallback {
 public:
  SeeIterates(const RolloutCost<float>& cost, const Eigen::VectorXd& latents,
              const IterateSeen& seen)
      : cost_(cost), latents_(latents), seen_(seen) {}

  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    // After a rejected step the cost has the rejected motion.
    if (summary.iteration > 0 && !summary.step_is_successful) return ceres::SOLVER_CONTINUE;
    if (!cost_.Look(latents_)) return ceres::SOLVER_ABORT;
    last_ = latents_;
    return seen_(summary.iteration) ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }
  // Reports the best iterate if it was not the last.
  void SeeResult(int iterations) {
    if (last_.size() > 0 && last_ != latents_ && cost_.Look(latents_)) seen_(iterations);
  }

 private:
  const RolloutCost<float>& cost_;
  const Eigen::VectorXd& latents_;
  const IterateSeen& seen_;
  Eigen::VectorXd last_;
};

// Limits iterations, not tolerances: otherwise float resolution of the rollouts ends a solve.
ceres::Solver::Options BaseOptions(int iterations) {
  ceres::Solver::Options options;
  options.max_num_iterations = iterations;
  options.function_tolerance = 1e-9;
  options.gradient_tolerance = 1e-9;
  options.parameter_tolerance = 0.0;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  return options;
}

}  // namespace

LatentSolve MinimizeLatents(RolloutCost<float>& cost, const Eigen::VectorXd& center,
                            double prior_weight, ceres::Solver::Options options,
                            Eigen::VectorXd& latents, const IterateSeen& seen) {
  ceres::Problem::Options unowned = BorrowingProblem();
  unowned.disable_all_safety_checks = true;
  ceres::Problem problem(unowned);
  const Eigen::Index size = cost.parameter_block_sizes()[0];
  std::vector<double*> steps;
  std::vector<std::unique_ptr<NearPoint>> priors;
  const auto residuals = options.minimizer_type == ceres::LINE_SEARCH
                             ? NearPoint::Residuals::kLength
                             : NearPoint::Residuals::kCoordinates;
  for (Eigen::Index at = 0; at < latents.size(); at += size) {
    steps.push_back(latents.data() + at);
    if (prior_weight <= 0.0) continue;
    priors.push_back(
        std::make_unique<NearPoint>(center.segment(at, size), prior_weight, residuals));
  }
  problem.AddResidualBlock(&cost, nullptr, steps);
  for (std::size_t t = 0; t < priors.size(); ++t) {
    problem.AddResidualBlock(priors[t].get(), nullptr, steps[t]);
  }
  SeeIterates watch(cost, latents, seen);
  options.callbacks.push_back(&watch);
  options.update_state_every_iteration = true;
  const ceres::Solver::Summary summary = SolveQuietly(options, problem);
  LatentSolve solve;
  if (summary.minimizer_type == ceres::TRUST_REGION) {
    solve.minimizer = ceres::TrustRegionStrategyTypeToString(summary.trust_region_strategy_type);
    solve.linear_solver = ceres::LinearSolverTypeToString(summary.linear_solver_type_used);
  } else {
    solve.minimizer = ceres::LineSearchDirectionTypeToString(summary.line_search_direction_type);
  }
  solve.iterations = StepsOf(summary);
  solve.termination = ceres::TerminationTypeToString(summary.termination_type);
  watch.SeeResult(solve.iterations);
  return solve;
}

LatentSolve DescendLatents(const std::string& name, const StepRule& rule, int iterations,
                           const RolloutCost<float>& cost, double prior_weight,
                           Eigen::VectorXd& latents, const IterateSeen& seen) {
  LatentSolve solve{name, {}, 0, "NO_CONVERGENCE"};
  Eigen::VectorXd next = latents, gradient;
  for (int iteration = 0;; ++iteration) {
    if (!cost.Look(next)) {
      solve.termination = "FAILURE";
      return solve;
    }
    latents = next;
    solve.iterations = iteration;
    if (seen(iteration)) solve.termination = "USER_SUCCESS";
    if (iteration == iterations || solve.termination == "USER_SUCCESS") return solve;
    gradient = cost.Gradient() + prior_weight * latents;
    if (rule(iteration, gradient, next)) continue;
    solve.termination = "CONVERGENCE";
    return solve;
  }
}

void Record(const MotionView& motion, int joint, const Eigen::Vector3d& goal, float seconds,
            ReachTrace& trace) {
  double closest = INFINITY, distance = INFINITY;
  for (int t = 0; t < motion.NumFrames(); ++t) {
    distance = (motion.At(t, joint) - goal).norm();
    closest = std::min(closest, distance);
  }
  trace.closest_m.push_back(static_cast<float>(closest));
  trace.last_m.push_back(static_cast<float>(distance));
  trace.seconds.push_back(seconds);
}

ceres::Solver::Options LevenbergMarquardtOptions(int iterations, double radius) {
  ceres::Solver::Options options = BaseOptions(iterations);
  options.linear_solver_type = ceres::CGNR;
  options.preconditioner_type = ceres::IDENTITY;
  options.max_linear_solver_iterations = 20;
  options.eta = 1e-2;
  // Damping grows with a latent's leverage: otherwise the early latents, which move the wrist most,
  // would leave the range in which the motion is linear.
  options.jacobi_scaling = false;
  options.min_lm_diagonal = 1e-4;
  options.initial_trust_region_radius = radius;
  return options;
}

ceres::Solver::Options LbfgsOptions(int iterations, int history) {
  ceres::Solver::Options options = BaseOptions(iterations);
  options.minimizer_type = ceres::LINE_SEARCH;
  options.line_search_direction_type = ceres::LBFGS;
  options.line_search_type = ceres::WOLFE;
  options.max_lbfgs_rank = history;
  return options;
}

bool Adam::operator()(int iteration, const Eigen::VectorXd& gradient, Eigen::VectorXd& variables) {
  constexpr double kMean = 0.9, kSquare = 0.999, kTiny = 1e-8;
  if (iteration == 0) {
    mean_.setZero(gradient.size());
    square_.setZero(gradient.size());
  }
  mean_ += (1.0 - kMean) * (gradient.array() - mean_);
  square_ += (1.0 - kSquare) * (gradient.array().square() - square_);
  const double left = 1.0 - static_cast<double>(iteration) / std::max(iterations_ - 1, 1);
  const double rate = first_rate_ * (last_ratio_ + (1.0 - last_ratio_) * left);
  const double step = rate / (1.0 - std::pow(kMean, iteration + 1));
  const double scale = 1.0 / std::sqrt(1.0 - std::pow(kSquare, iteration + 1));
  variables.array() -= step * mean_ / (scale * square_.sqrt() + kTiny);
  return true;
}

bool LbfgsStepOne::operator()(int iteration, const Eigen::VectorXd& gradient,
                              Eigen::VectorXd& variables) {
  if (gradient.lpNorm<Eigen::Infinity>() <= 1e-7) return false;
  if (iteration > 0) {
    // A step without significant positive curvature is not stored.
    const Eigen::VectorXd change = gradient - before_;
    const double curvature = change.dot(step_);
    if (curvature > 1e-10) pairs_.push_back({step_, change, curvature});
    if (pairs_.size() > history_) pairs_.pop_front();
  }
  step_ = -gradient;
  std::vector<double> along;
  for (const Pair& pair : pairs_ | std::views::reverse) {
    along.push_back(pair.step.dot(step_) / pair.curvature);
    step_ -= along.back() * pair.change;
  }
  if (!pairs_.empty()) step_ *= pairs_.back().curvature / pairs_.back().change.squaredNorm();
  for (const Pair& pair : pairs_) {
    step_ += (along.back() - pair.change.dot(step_) / pair.curvature) * pair.step;
    along.pop_back();
  }
  if (iteration == 0) step_ *= std::min(1.0, 1.0 / gradient.lpNorm<1>());
  before_ = gradient;
  variables += step_;
  return true;
}

}  // namespace holdfast
