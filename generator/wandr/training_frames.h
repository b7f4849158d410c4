// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "generator/nn/random_stream.h"
#include "generator/wandr/goal_plan.h"
#include "generator/wandr/network.h"
#include "generator/wandr/pose.h"

namespace holdfast::wandr {

/// A motion of F frames at 30 fps in the forms that features are made of.
struct MotionFrames {
  std::vector<Pose<double>> poses;
  std::vector<BodyJoints<double>> joints;  ///< by forward kinematics, whatever a file had stored
};

MotionFrames FramesOfStates(const Eigen::Ref<const StateMatrix<double>>& states,
                            const BoneOffsets<double>& bones);

/// Which later frame's wrist is the goal of a frame, in hindsight.
enum class HindsightMode {
  kFarEnough,  ///< any later frame whose pelvis is min_distance_m away (`only_use_goal_when_close`)
  kAnyFuture,  ///< any later frame (the paper's text)
  kFixedOffset,  ///< the frame `offset` later
};

struct HindsightOptions {
  HindsightMode mode = HindsightMode::kFarEnough;
  double min_distance_m = 1.5;  ///< `cutoff_distance`, horizontal
  int offset = 30;              ///< frames
  /// A frame in which the wrist is where it wanted to be: the goal of all frames before it, and
  /// later frames have none. Whatever the mode.
  std::optional<int> labeled_goal;
};

/// The goal frame j >= i of every frame i, drawn anew at each call, uniformly among the candidates;
/// j = i means no goal.
std::vector<int> HindsightGoals(const MotionFrames& motion, const HindsightOptions& options,
                                nn::RandomStream& random);

/// What a network is trained on, one frame per column, normalized, as at run time:
/// condition c_i and the delta from frame i to i + 1, for i = 0 .. F-2.
struct TrainingFrames {
  Eigen::MatrixXf conditions;  ///< (277 x F-1)
  StateMatrix<float> targets;  ///< (135 x F-1)
};

/// Goals by HindsightGoals: G is the wrist at j, eta = j - i, g_hat the heading at j; without a
/// goal (j = i) the intention is zero. Throws Error for fewer than two frames.
TrainingFrames MakeTrainingFrames(const MotionFrames& motion, const std::vector<int>& goal_frames,
                                  IntentionLayout layout, const Normalizer<double>& normalizer,
                                  Side wrist = Side::kRight);

/// The goal of frame i in the training form, for rollouts during training.
FrameGoal<double> HindsightGoal(const MotionFrames& motion, int frame, int goal_frame, Side wrist);

}  // namespace holdfast::wandr
