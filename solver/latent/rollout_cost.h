// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <optional>

#include <ceres/cost_function.h>
#include <ceres/problem.h>

#include <Eigen/Core>

#include "solver/latent/motion_objective.h"
#include "solver/latent/rollout_batch.h"

namespace holdfast {

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
