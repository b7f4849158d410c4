// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "solver/latent/lbfgs_memory.h"

namespace holdfast {

/// An optimiser that takes every step it makes: from the gradient to the next variables, without a
/// look at the objective. One per motion; `iteration` counts from 0.
class StepRule {
 public:
  virtual ~StepRule() = default;
  /// False when there is nothing left to gain.
  virtual bool Step(int iteration, const Eigen::Ref<const Eigen::VectorXf>& gradient,
                    Eigen::Ref<Eigen::VectorXf> variables) = 0;
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
  bool Step(int iteration, const Eigen::Ref<const Eigen::VectorXf>& gradient,
            Eigen::Ref<Eigen::VectorXf> variables) override;

 private:
  AdamRates rates_;
  Eigen::ArrayXf mean_, square_;
};

/// L-BFGS that takes every step whole, the first as steepest descent of length at most 1 (in the
/// sum of magnitudes); it stops where no entry of the gradient is above 1e-7.
class LbfgsStepOne final : public StepRule {
 public:
  explicit LbfgsStepOne(int history) : memory_(history) {}
  bool Step(int iteration, const Eigen::Ref<const Eigen::VectorXf>& gradient,
            Eigen::Ref<Eigen::VectorXf> variables) override;

 private:
  LbfgsMemory memory_;
  Eigen::VectorXd step_, before_;
};

}  // namespace holdfast
