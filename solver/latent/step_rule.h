// SPDX-License-Identifier: MIT
#pragma once

#include <deque>

#include <Eigen/Core>

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

}  // namespace holdfast
