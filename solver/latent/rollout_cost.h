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

/// A joint that is to be at a place in one frame, as rows of their own.
struct GoalRows {
  int frame = 0;
  int joint = 0;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  double sigma_m = 1.0;
};

/// E and, added, its derivative with respect to the motion.
using MotionEnergy = std::function<double(const MotionView&, MotionGradient&)>;

/// What a motion's latents lead to: the one chain rule through a rollout.
///
///   r_0..2 = (q_joint,frame - G) / sigma      the goal (Diomataris et al. 2024, sec. 4), if given
///   r_last = sqrt(2 E)                        all other terms of the motion, if given
///
/// 1, 3 or 4 residuals. E is a sum of thousands (MotionObjective); r_last has its value and its
/// exact gradient, r J = dE/dz. Parameter blocks: the latents z_t of steps 0..T-1 (64 each). The
/// Jacobian comes from the rollout's adjoint, a backward pass of as many rows; residuals and
/// Jacobian are evaluated together and kept until other latents come. False for a motion that is
/// not finite, and when the batch ends.
template <typename Real>
class RolloutCost final : public ceres::CostFunction {
 public:
  /// `batch` must outlive it, and evaluate it from solve(motion). `view`: with the body's points.
  RolloutCost(RolloutBatch<Real>& batch, int motion, MotionView view, std::optional<GoalRows> goal,
              MotionEnergy rest);

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

  /// The same of latents in one piece (64 T); then:
  bool Look(const Eigen::VectorXd& latents) const;
  const MotionView& Motion() const { return view_; }
  double Value() const { return 0.5 * residuals_.squaredNorm(); }
  Eigen::VectorXd Gradient() const { return jacobian_.template cast<double>() * residuals_; }
  /// What was kept no longer counts: E has changed.
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
