// SPDX-License-Identifier: MIT
#include "solver/latent/lbfgs_memory.h"

#include <vector>

namespace holdfast {

void LbfgsMemory::Remember(const Eigen::VectorXd& step, const Eigen::VectorXd& gradient_change) {
  const double curvature = gradient_change.dot(step);
  if (!(curvature > 1e-10)) return;
  pairs_.push_back({step, gradient_change, curvature});
  if (Size() > history_) pairs_.pop_front();
}

Eigen::VectorXd LbfgsMemory::Direction(const Eigen::VectorXd& gradient) const {
  Eigen::VectorXd direction = -gradient;
  if (pairs_.empty()) return direction;
  std::vector<double> along(pairs_.size());
  for (std::size_t i = pairs_.size(); i-- > 0;) {
    const Pair& pair = pairs_[i];
    along[i] = pair.step.dot(direction) / pair.curvature;
    direction -= along[i] * pair.change;
  }
  direction *= pairs_.back().curvature / pairs_.back().change.squaredNorm();
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const Pair& pair = pairs_[i];
    direction += (along[i] - pair.change.dot(direction) / pair.curvature) * pair.step;
  }
  return direction;
}

}  // namespace holdfast
