// SPDX-License-Identifier: MIT
#include "solver/latent/goal_objective.h"

#include <algorithm>

namespace holdfast {

template <typename Real>
GoalObjective<Real>::GoalObjective(const wandr::Network<Real>& network,
                                   const wandr::BoneOffsets<Real>& bones, int max_motions,
                                   int num_steps, const GoalObjectiveWeights& weights)
    : bones_(bones),
      latent_size_(network.LatentSize()),
      num_steps_(num_steps),
      weights_(weights),
      rollout_(network, bones, max_motions, num_steps, {}, true),
      no_plans_(max_motions) {
  seed_.joints.resize(num_steps + 1);
}

template <typename Real>
void GoalObjective<Real>::Evaluate(std::span<const wandr::RolloutStart<Real>> starts,
                                   std::span<const Eigen::Vector3d> goals,
                                   const Eigen::Ref<const Matrix>& latents, Values& values,
                                   Matrix* gradient) {
  const Eigen::Index count = latents.cols();
  rollout_.Begin(starts, std::span(no_plans_).first(count));
  for (int t = 0; t < num_steps_; ++t) {
    rollout_.Step(latents.middleRows(Eigen::Index{latent_size_} * t, latent_size_));
  }
  values.value.resize(count);
  values.closest_m.resize(count);
  values.last_m.resize(count);
  const double goal_weight = 1.0 / (weights_.goal_sigma_m * weights_.goal_sigma_m);
  Matrix& joints_bar = seed_.joints.back();
  joints_bar.setZero(wandr::kJointNumbers, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    Eigen::Vector3d from_goal = Eigen::Vector3d::Zero();
    for (int t = 0; t <= num_steps_; ++t) {
      from_goal =
          wandr::WristPosition(bones_, rollout_.Poses(t)[i], Side::kRight).template cast<double>() -
          goals[i];
      const double distance = from_goal.norm();
      values.closest_m[i] = t == 0 ? distance : std::min(values.closest_m[i], distance);
    }
    values.last_m[i] = from_goal.norm();
    values.value[i] =
        0.5 * goal_weight * from_goal.squaredNorm() +
        0.5 * weights_.prior_weight * latents.col(i).template cast<double>().squaredNorm();
    joints_bar.col(i).template segment<3>(3 * WristJoint(Side::kRight)) =
        (goal_weight * from_goal).template cast<Real>();
  }
  if (!gradient) return;
  rollout_.Backward(seed_, 1, rollout_gradient_);
  *gradient = rollout_gradient_.latents + static_cast<Real>(weights_.prior_weight) * latents;
}

template class GoalObjective<float>;
template class GoalObjective<double>;

}  // namespace holdfast
