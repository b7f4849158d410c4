// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "generator/training/wandr/goal_loss.h"
#include "generator/wandr/goal_plan.h"
#include "generator/wandr/intention.h"
#include "generator/wandr/pose.h"
#include "generator/wandr/statistics.h"

namespace holdfast::wandr {

/// A stretch of a captured or synthetic motion that a network is to live through.
struct TrainingWindow {
  const Pose<float>* truth = nullptr;   ///< poses of frames 0 .. steps; of frame 0 alone if free
  const Pose<float>* before = nullptr;  ///< the pose before frame 0; none: it starts at rest
  GoalPlan plan;                        ///< frames counted from the window's frame 0
  bool free = false;                    ///< nothing to follow but the plan's first goal
  /// Perturbation of the body at frame 0 (a tangent; its translation's height alone counts). The
  /// target is blended back to the data: the perturbation decays with kRecoveryFrames. Networks
  /// trained without it do not recover from their own errors.
  TangentVector<float> perturbation = TangentVector<float>::Zero();
};

inline constexpr float kRecoveryFrames = 8.0f;  ///< time constant of that decay

/// Weights of what the joints of an unrolled body are asked for, beside the deltas.
struct JointLossWeights {
  float position = 0.3f;        ///< where they are, in units of 2 cm
  float foot_velocity = 0.06f;  ///< how feet move, in units of 4 mm a frame
  float foot_contact = 0.06f;   ///< that feet stay where the true ones do, in the same units
};

/// N bodies unrolled over A steps by a network that somebody else runs: this class makes its
/// conditions and targets, applies its deltas, and carries gradients back through features,
/// kinematics and steps. The features are the ones of inference (condition.h, intention.h), their
/// derivatives those of the rollout (Rollout::Backward).
///
/// Matrices hold one body per column; a row-major tensor (N x size) is the same memory.
/// The losses' robust square is rho(e) = 18 (sqrt(1 + e / 9) - 1), e a squared error in units.
class UnrolledBatch {
 public:
  using Matrix = Eigen::MatrixXf;

  UnrolledBatch(const Statistics& statistics, const BoneOffsets<float>& bones,
                IntentionLayout layout, const IntentionOptions& intention, int max_bodies,
                int max_steps);

  /// Begins with these windows, each of at least `steps` + 1 frames.
  void Begin(std::span<const TrainingWindow> windows, int steps);

  int NumBodies() const { return static_cast<int>(windows_.size()); }
  int ConditionSize() const { return wandr::ConditionSize(layout_); }

  /// Conditions of step a, and the *corrective* deltas: those that would carry the bodies, wherever
  /// they have come to, to where the truth is one frame later. Both normalized.
  void WriteInputs(int step, Eigen::Ref<Matrix> conditions, Eigen::Ref<Matrix> targets,
                   int threads);
  /// Applies the network's deltas u (135 x N, normalized); returns the joints' losses of this step,
  /// each body's times its `weights` entry, summed.
  double Advance(int step, const Eigen::Ref<const Matrix>& deltas, const JointLossWeights& losses,
                 const Eigen::Ref<const Eigen::VectorXf>& weights, int threads);

  /// Judges the whole motions of free windows by their goals (goal_loss.h), each with this weight;
  /// to be called when all steps are done. Returns the sum.
  double JudgeByGoals(const GoalLossWeights& losses, const FootHeights& standing, float weight,
                      int threads);

  /// Gradients, from the last step to the first. OutputGradient gives what the joints' losses and
  /// all later steps say of the deltas of `step`; ConditionGradient takes what the network made of
  /// it (and of its own losses) for the conditions of that step.
  void OutputGradient(int step, Eigen::Ref<Matrix> deltas_bar, int threads);
  /// A body's gradient of its pose is cut to norm `largest`: over hundreds of steps few grow
  /// beyond all others.
  void ConditionGradient(int step, const Eigen::Ref<const Matrix>& conditions_bar, float largest,
                         int threads);

  /// What body i is to follow, frames 0 .. steps.
  const Pose<float>& TruthAt(int body, int step) const { return truth_[Index(body, step)]; }
  const Pose<float>& PoseAt(int body, int step) const { return poses_[Index(body, step)]; }

 private:
  std::size_t Index(int body, int step) const {
    return static_cast<std::size_t>(step) * max_bodies_ + body;
  }

  Normalizer<float> norms_;
  BoneOffsets<float> bones_;
  IntentionLayout layout_;
  IntentionOptions intention_;
  int max_bodies_;
  int steps_ = 0;
  std::vector<TrainingWindow> windows_;
  std::vector<Pose<float>> truth_;  // step by step
  std::vector<Pose<float>> poses_;
  std::vector<BodyKinematics<float>> placed_;  // of poses_
  std::vector<BodyJoints<float>> joints_bar_;  // of the losses, by pose
  Matrix deltas_;                              // (135 x N (A + 1)), u_{a-1} before step a
  Matrix pose_bar_;                            // (69 x N)
  Matrix previous_bar_;                        // (135 x N), of u_{a-1} as a condition
};

}  // namespace holdfast::wandr
