// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "generator/actions/action_path.h"
#include "generator/actions/action_script.h"
#include "generator/matching/body_frame.h"
#include "generator/matching/capture_quality.h"
#include "generator/matching/leg_placement.h"
#include "solver/body_ik/frame_pose.h"
#include "solver/terms/body/goal_terms.h"
#include "solver/terms/body/posture_terms.h"

namespace holdfast {

struct ActionBodyOptions {
  JointLimits joint_limits = CapturedJointLimits();
  double frame_rate = 30.0;
  int knot_frames = 5;
  double hand_sigma_m = 0.012;
  double gaze_sigma = 0.12;
  double lean_sigma = 0.05;
  int max_iterations = 12;
};

struct ActionBodyReport {
  double worst_hand_m = 0.0;    ///< from where it is wanted, before the arm is made exact
  double worst_missed_m = 0.0;  ///< of an ankle
  int iterations = 0;
  bool usable = false;
};

/// Trunk, head, right arm and pelvis of a whole clip, so that the right wrist goes along `path`
/// (until `path_end_s`; later it is free), the face turns and the chest leans as the script says:
/// least squares over all frames at once (Ceres), HeldAtFace, Gaze, TrunkLean, LegReach, Balance,
/// JointRange and a prior over a cubic B-spline change of `frames`, a person who stands idle. Feet
/// stay where `feet` says: the legs follow by two-bone inverse kinematics. Captured idling stays
/// underneath.
ActionBodyReport MoveActionBody(const Eigen::Matrix3Xd& rest_joints, const FeetTarget& feet,
                                const ActionScript& script, const ActionPath& path,
                                double path_end_s, const ActionBodyOptions& options,
                                std::vector<BodyFrame>& frames);

/// All that is asked of a body in one frame of an action: 26 residuals.
struct ActionFrameTerms {
  HeldAtFace hand;
  Gaze gaze;
  TrunkLean lean;
  LegReach legs;
  Balance balance;
  JointRange range;

  auto Tied() const { return std::tie(hand, gaze, lean, legs, balance, range); }
};
using ActionFrameBlock = FrameBlock<ActionFrameTerms>;

}  // namespace holdfast
