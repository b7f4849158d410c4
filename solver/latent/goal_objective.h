// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include <Eigen/Core>

#include "generator/wandr/network.h"
#include "generator/wandr/rollout.h"

namespace holdfast {

/// What "VAE + opt" minimises over the latents z of a motion prior's rollout of T steps:
///   F(z) = |W_T - G|^2 / (2 sigma_g^2) + lambda/2 sum_t |z_t|^2,
/// W_T the right wrist in the last frame, G the goal (metres, world), the network blind to the goal
/// (an empty GoalPlan). Only that the wrist's distance is minimised is published (Diomataris et al.
/// 2024, sec. 4); square, last frame and the prior are one reading of it.
struct GoalObjectiveWeights {
  double goal_sigma_m = 1.0;  ///< sigma_g, metres
  /// lambda, per latent. It decides how near a good optimiser ends: of 24 goals, L-BFGS with a line
  /// search came within 6 cm on average with 1e-4, within 1 cm with 1e-6.
  double prior_weight = 1e-4;
};

/// F and its gradient for N motions at a time, by one rollout and one exact backward pass. A
/// motion's numbers do not depend on the others.
template <typename Real>
class GoalObjective {
 public:
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;

  /// `network` must outlive it.
  GoalObjective(const wandr::Network<Real>& network, const wandr::BoneOffsets<Real>& bones,
                int max_motions, int num_steps, const GoalObjectiveWeights& weights);

  struct Values {
    Eigen::VectorXd value;      ///< F; not a number where the motion is not
    Eigen::VectorXd closest_m;  ///< least distance of wrist and goal over frames 0..T
    Eigen::VectorXd last_m;     ///< distance in frame T
  };

  /// `latents` is (64 T x N), a motion per start and goal. `gradient`, of the same size, may be
  /// null: a rollout alone.
  void Evaluate(std::span<const wandr::RolloutStart<Real>> starts,
                std::span<const Eigen::Vector3d> goals, const Eigen::Ref<const Matrix>& latents,
                Values& values, Matrix* gradient);

 private:
  wandr::BoneOffsets<Real> bones_;
  int latent_size_, num_steps_;
  GoalObjectiveWeights weights_;
  wandr::Rollout<Real> rollout_;
  std::vector<wandr::GoalPlan> no_plans_;
  wandr::RolloutSeed<Real> seed_;
  wandr::RolloutGradient<Real> rollout_gradient_;
};

extern template class GoalObjective<float>;
extern template class GoalObjective<double>;

}  // namespace holdfast
