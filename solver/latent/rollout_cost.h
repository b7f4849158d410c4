// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include <ceres/cost_function.h>
#include <ceres/problem.h>
#include <Eigen/Core>

#include "generator/wandr/network.h"
#include "generator/wandr/reach_goals.h"
#include "generator/wandr/rollout.h"
#include "solver/latent/latent_options.h"
#include "solver/latent/motion_objective.h"

namespace holdfast {

/// Rollouts of equal length that share each pass over the network's weights, although each has its
/// own solver. Solvers run on threads, one at a time; when all of them wait for a rollout, all
/// rollouts run at once. Results do not depend on the other motions.
template <typename Real>
class RolloutBatch {
 public:
  using Vector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;

  /// `network` must outlive this. `poll` is called before each pass; exceptions end all solvers.
  RolloutBatch(const wandr::Network<Real>& network, const wandr::BoneOffsets<Real>& bones,
               const wandr::IntentionOptions& intention,
               std::vector<wandr::RolloutStart<Real>> starts, std::vector<wandr::GoalPlan> plans,
               int num_steps, std::function<void()> poll = {});

  int NumMotions() const { return static_cast<int>(starts_.size()); }
  int NumSteps() const { return num_steps_; }
  int LatentSize() const { return latent_size_; }
  const wandr::BoneOffsets<double>& Bones() const { return bones_; }
  /// Seconds since construction, divided by the number of motions.
  float Seconds() const;

  /// Calls solve(i) for every motion i. Rethrows the exception of `poll` or the first solver's.
  void Solve(const std::function<void(int)>& solve);

  /// Returns the pose of a frame.
  using PoseAt = std::function<const wandr::Pose<Real>&(int frame)>;
  /// Writes the derivatives of each row with respect to the motion.
  using SeedRows = std::function<void(const PoseAt&, std::span<MotionGradient> rows)>;
  /// Called from solve(motion): runs `latents` (64 T). `out` (64 T x `rows`) receives the rollout's
  /// adjoint of the seeds. All solvers of one Solve must request the same number of rows. Returns
  /// false if the run has to end.
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

  std::mutex working_;  // held by the running solver
  std::condition_variable answered_;
  std::vector<Request> requests_;
  int rows_ = 0, active_ = 0, waiting_ = 0;
  std::exception_ptr failure_;
};

extern template class RolloutBatch<float>;
extern template class RolloutBatch<double>;

/// Residual rows for the target position of a joint in one frame.
struct GoalRows {
  int frame = 0;
  int joint = 0;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  double sigma_m = 1.0;
};

/// Returns E; adds its derivative with respect to the motion.
using MotionEnergy = std::function<double(const MotionView&, MotionGradient&)>;

/// Cost of a motion as a function of its latents: the only chain rule through a rollout.
///
///   r_0..2 = (q_joint,frame - G) / sigma      the goal (Diomataris et al. 2024, sec. 4), if given
///   r_last = sqrt(2 E)                        all other terms of the motion, if given
///
/// 1, 3 or 4 residuals. E is a sum of thousands of terms (MotionObjective); r_last has its value
/// and exact gradient, r J = dE/dz. Parameter blocks: the latents z_t of steps 0..T-1 (64 each).
/// The Jacobian comes from the rollout's adjoint, a backward pass with as many rows; residuals and
/// Jacobian are evaluated together and cached until the latents change. Returns false for a motion
/// that is not finite, and when the batch ends.
template <typename Real>
class RolloutCost final : public ceres::CostFunction {
 public:
  /// `batch` must outlive this, and evaluate it from solve(motion). `view`: with the body's points.
  RolloutCost(RolloutBatch<Real>& batch, int motion, MotionView view, std::optional<GoalRows> goal,
              MotionEnergy rest);

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

  /// Evaluates latents given as one vector (64 T); the results are then available from:
  bool Look(const Eigen::VectorXd& latents) const;
  const MotionView& Motion() const { return view_; }
  double Value() const { return 0.5 * residuals_.squaredNorm(); }
  Eigen::VectorXd Gradient() const { return jacobian_.template cast<double>() * residuals_; }
  /// Invalidates the cache after a change of E.
  void Forget() { latents_.resize(0); }

 private:
  void SeedFrom(const typename RolloutBatch<Real>::PoseAt& pose,
                std::span<MotionGradient> rows) const;

  RolloutBatch<Real>& batch_;
  int motion_;
  std::optional<GoalRows> goal_;
  MotionEnergy rest_;
  mutable MotionView view_;
  mutable Eigen::VectorXd latents_, residuals_;
  mutable Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic> jacobian_;  // transposed
  mutable bool finite_ = false;
};

extern template class RolloutCost<float>;
extern template class RolloutCost<double>;

}  // namespace holdfast
