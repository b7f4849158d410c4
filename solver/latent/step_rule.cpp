// SPDX-License-Identifier: MIT
#include "solver/latent/step_rule.h"

#include <algorithm>
#include <cmath>

namespace holdfast {

bool Adam::Step(int iteration, const Eigen::Ref<const Eigen::VectorXf>& gradient,
                Eigen::Ref<Eigen::VectorXf> variables) {
  constexpr double kMean = 0.9;
  const double square_decay = rates_.square_decay;
  if (iteration == 0) {
    mean_.setZero(gradient.size());
    square_.setZero(gradient.size());
  }
  mean_ += static_cast<float>(1.0 - kMean) * (gradient.array() - mean_);
  square_ += static_cast<float>(1.0 - square_decay) * (gradient.array().square() - square_);
  const double left = 1.0 - static_cast<double>(iteration) / std::max(rates_.iterations - 1, 1);
  const double rate = rates_.first * (rates_.last_ratio + (1.0 - rates_.last_ratio) * left);
  const auto step = static_cast<float>(rate / (1.0 - std::pow(kMean, iteration + 1)));
  const auto scale =
      static_cast<float>(1.0 / std::sqrt(1.0 - std::pow(square_decay, iteration + 1)));
  variables.array() -= step * mean_ / (scale * square_.sqrt() + static_cast<float>(rates_.tiny));
  return true;
}

bool LbfgsStepOne::Step(int iteration, const Eigen::Ref<const Eigen::VectorXf>& gradient,
                        Eigen::Ref<Eigen::VectorXf> variables) {
  const Eigen::VectorXd now = gradient.cast<double>();
  if (now.lpNorm<Eigen::Infinity>() <= 1e-7) return false;
  if (iteration > 0) memory_.Remember(step_, now - before_);
  step_ = memory_.Direction(now);
  if (iteration == 0) step_ *= std::min(1.0, 1.0 / now.lpNorm<1>());
  before_ = now;
  variables += step_.cast<float>();
  return true;
}

}  // namespace holdfast
