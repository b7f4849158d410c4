// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "generator/wandr/rollout.h"
#include "generator/wandr/run_rollouts.h"
#include "solver/latent/latent_options.h"
#include "solver/latent/motion_objective.h"
#include "solver/latent/reach_task.h"

namespace holdfast {

/// One task while its latents are optimized.
struct LatentSample {
  const ReachTask* task = nullptr;
  int index = 0;
  Eigen::VectorXf centre;    ///< z_0
  Eigen::VectorXf latents;   ///< z
  Eigen::VectorXf gradient;  ///< of the objective with respect to z
  MotionView motion;
  MotionObjective natural;  ///< AddNaturalTerms
  int contacts_age = 0;     ///< iterations since contacts were found; 0: not yet

  double closest_m = std::numeric_limits<double>::infinity();     ///< of all frames
  double last_m = std::numeric_limits<double>::infinity();        ///< in the last
  double goal_error_m = std::numeric_limits<double>::infinity();  ///< at the arrival
  int arrival = 0;                                                ///< frame that the goal counts at
  double value = std::numeric_limits<double>::infinity();         ///< of the objective
  bool done = false;
};

/// Latents to motion and back, for some samples side by side: rollout, objective, and what the
/// rollout's vector-Jacobian product makes of its gradient. What becomes of one does not depend on
/// the others.
class LatentProblem {
 public:
  /// All must outlive it. `capacity`: most samples at a time.
  LatentProblem(const wandr::Network<float>& network, const LatentBody& body,
                const LatentOptions& options, int num_steps, int capacity);

  /// Runs the latents and measures. On a trial contacts stay those found before.
  void Forward(std::span<LatentSample* const> samples, bool trial = false);
  /// Value and gradient of the whole objective, of the motions run last.
  void Gradient(std::span<LatentSample* const> samples, double share_done);
  /// Rows of the dual Gauss-Newton system: the goal's three coordinates at the arrival by
  /// `sigma_m`, and sqrt(2 penalty_scale E) of the natural terms E. For each traveller r (4) and
  /// J^T (64 T x 4).
  void Rows(std::span<LatentSample* const> samples, double sigma_m, double penalty_scale,
            std::vector<Eigen::MatrixXf>& J, std::vector<Eigen::Vector4d>& r);
  /// E of the motion run last.
  double Natural(const LatentSample& one) const;
  wandr::RolloutTrack TrackOf(std::size_t i) const;

 private:
  void Prepare(Eigen::Index columns);
  void Put(const MotionGradient& bar, Eigen::Index column);

  const LatentBody& body_;
  wandr::BoneOffsets<double> bones_;
  const LatentOptions& options_;
  int steps_;
  Eigen::Index latent_size_;
  wandr::Rollout<float> rollout_;
  wandr::RolloutSeed<float> seed_;
  wandr::RolloutGradient<float> gradient_;
};

}  // namespace holdfast
