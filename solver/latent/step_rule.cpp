// SPDX-License-Identifier: MIT
#include "solver/latent/step_rule.h"

#include <algorithm>
#include <cmath>
#include <ranges>
#include <vector>

namespace holdfast {

bool Adam::Step(int iteration, const Eigen::VectorXd& gradient, Eigen::VectorXd& variables) {
  constexpr double kMean = 0.9;
  const double square_decay = rates_.square_decay;
  if (iteration == 0) {
    mean_.setZero(gradient.size());
    square_.setZero(gradient.size());
  }
  mean_ += (1.0 - kMean) * (gradient.array() - mean_);
  square_ += (1.0 - square_decay) * (gradient.array().square() - square_);
  const double left = 1.0 - static_cast<double>(iteration) / std::max(rates_.iterations - 1, 1);
  const double rate = rates_.first * (rates_.last_ratio + (1.0 - rates_.last_ratio) * left);
  const double step = rate / (1.0 - std::pow(kMean, iteration + 1));
  const double scale = 1.0 / std::sqrt(1.0 - std::pow(square_decay, iteration + 1));
  variables.array() -= step * mean_ / (scale * square_.sqrt() + rates_.tiny);
  return true;
}

bool LbfgsStepOne::Step(int iteration, const Eigen::VectorXd& gradient,
                        Eigen::VectorXd& variables) {
  if (gradient.lpNorm<Eigen::Infinity>() <= 1e-7) return false;
  if (iteration > 0) {
    // Without noticeable positive curvature a step is not remembered.
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
