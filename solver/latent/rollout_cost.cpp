// SPDX-License-Identifier: MIT
#include "solver/latent/rollout_cost.h"

#include <cmath>
#include <utility>

namespace holdfast {

template <typename Real>
RolloutCost<Real>::RolloutCost(RolloutBatch<Real>& batch, int motion, MotionView view,
                               std::optional<GoalRows> goal, MotionEnergy rest)
    : batch_(batch), motion_(motion), goal_(goal), rest_(std::move(rest)), view_(std::move(view)) {
  view_.Resize(batch.NumSteps() + 1);
  set_num_residuals((goal_ ? 3 : 0) + (rest_ ? 1 : 0));
  mutable_parameter_block_sizes()->assign(static_cast<std::size_t>(batch.NumSteps()),
                                          batch.LatentSize());
}

template <typename Real>
bool RolloutCost<Real>::Evaluate(double const* const* parameters, double* residuals,
                                 double** jacobians) const {
  const int steps = batch_.NumSteps(), size = batch_.LatentSize();
  Eigen::VectorXd latents(Eigen::Index{size} * steps);
  for (int t = 0; t < steps; ++t) {
    latents.segment(Eigen::Index{size} * t, size) =
        Eigen::Map<const Eigen::VectorXd>(parameters[t], size);
  }
  if (!Look(latents)) return false;
  Eigen::Map<Eigen::VectorXd>(residuals, num_residuals()) = residuals_;
  for (int t = 0; jacobians != nullptr && t < steps; ++t) {
    if (jacobians[t] == nullptr) continue;
    Eigen::Map<Eigen::MatrixXd>(jacobians[t], size, num_residuals()) =
        jacobian_.middleRows(Eigen::Index{size} * t, size).template cast<double>();
  }
  return true;
}

template <typename Real>
bool RolloutCost<Real>::Look(const Eigen::VectorXd& latents) const {
  if (latents.size() == latents_.size() && latents == latents_) return finite_;
  latents_ = latents;
  residuals_.setZero(num_residuals());
  finite_ = batch_.Evaluate(
                motion_, latents.cast<Real>(), num_residuals(),
                [this](const auto& pose, std::span<MotionGradient> rows) { SeedFrom(pose, rows); },
                jacobian_) &&
            residuals_.allFinite() && jacobian_.allFinite();
  return finite_;
}

template <typename Real>
void RolloutCost<Real>::SeedFrom(const typename RolloutBatch<Real>::PoseAt& pose,
                                 std::span<MotionGradient> rows) const {
  for (int t = 0; t < view_.NumFrames(); ++t) view_.Set(t, pose(t), batch_.Bones());
  if (goal_) {
    residuals_.head<3>() = (view_.At(goal_->frame, goal_->joint) - goal_->place) / goal_->sigma_m;
    for (int k = 0; k < 3; ++k) {
      rows[static_cast<std::size_t>(k)].joints(3 * goal_->joint + k, goal_->frame) =
          1.0 / goal_->sigma_m;
    }
  }
  if (!rest_) return;
  MotionGradient& bar = rows.back();
  const double root = std::sqrt(2.0 * rest_(view_, bar) + 1e-12);
  residuals_[num_residuals() - 1] = root;
  bar.joints /= root;
  bar.poses /= root;
}

template class RolloutCost<float>;
template class RolloutCost<double>;

}  // namespace holdfast
