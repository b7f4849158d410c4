// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "generator/wandr/network.h"
#include "generator/wandr/rollout.h"
#include "solver/latent/motion_objective.h"

namespace holdfast {

/// Rollouts of the same length that share each pass over the network's weights, though a solver of
/// its own asks for each: solvers run on threads of which one works at a time; when all of them
/// wait for a rollout, all are run at once. What a motion gets does not depend on the others.
template <typename Real>
class RolloutBatch {
 public:
  using Vector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;

  /// `network` must outlive it. `poll` is called before each pass; what it throws ends all solvers.
  RolloutBatch(const wandr::Network<Real>& network, const wandr::BoneOffsets<Real>& bones,
               const wandr::IntentionOptions& intention,
               std::vector<wandr::RolloutStart<Real>> starts, std::vector<wandr::GoalPlan> plans,
               int num_steps, std::function<void()> poll = {});

  int NumMotions() const { return static_cast<int>(starts_.size()); }
  int NumSteps() const { return num_steps_; }
  int LatentSize() const { return latent_size_; }
  const wandr::BoneOffsets<double>& Bones() const { return bones_; }
  /// Since it was made, by the number of motions.
  float Seconds() const;

  /// Calls solve(i) for every motion i. Rethrows what `poll` or the first of them threw.
  void Solve(const std::function<void(int)>& solve);

  /// Of the frame's pose.
  using PoseAt = std::function<const wandr::Pose<Real>&(int frame)>;
  /// Writes the derivatives of each row with respect to the motion, and says how many there are.
  using SeedRows = std::function<void(const PoseAt&, std::span<MotionGradient> rows)>;
  /// From solve(motion): runs latents (64 T); rows (64 T x `rows`) are what the rollout's adjoint
  /// makes of the seeds. All solvers of one Solve ask for the same number of rows. False when the
  /// run is to end.
  bool Evaluate(int motion, const Vector& latents, int rows, const SeedRows& seed, Matrix& out);

 private:
  struct Request {
    const Vector* latents = nullptr;  // null: none
    const SeedRows* seed = nullptr;
    Matrix* out = nullptr;
  };
  void RunIfAllWait();
  void Run();

  wandr::BoneOffsets<double> bones_;
  std::vector<wandr::RolloutStart<Real>> starts_;
  std::vector<wandr::GoalPlan> plans_;
  int latent_size_, num_steps_;
  std::function<void()> poll_;
  wandr::Rollout<Real> rollout_;
  wandr::RolloutSeed<Real> seed_;
  wandr::RolloutGradient<Real> gradient_;
  std::vector<MotionGradient> bars_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();

  std::mutex working_;  // held by the solver that works
  std::condition_variable answered_;
  std::vector<Request> requests_;
  int rows_ = 0, active_ = 0, waiting_ = 0;
  std::exception_ptr failure_;
};

extern template class RolloutBatch<float>;
extern template class RolloutBatch<double>;

}  // namespace holdfast
