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
  double worst_hand_m = 0.0;    ///< distance to its target, before the exact arm IK
  double worst_missed_m = 0.0;  ///< of an ankle
  int iterations = 0;
  bool usable = false;
};

/// Solves trunk, head, right arm and pelvis of a whole clip so that the right wrist follows `path`
/// (until `path_end_s`; free afterwards) and the face turns and the chest leans as scripted: least
/// squares over all frames at once (Ceres) with HeldAtFace, Gaze, TrunkLean, LegReach, Balance,
/// JointRange and a prior, over a cubic B-spline change of `frames`, an idling person. Feet stay at
/// `feet`: the legs follow by two-bone inverse kinematics. The captured idle motion is preserved
/// underneath.
ActionBodyReport MoveActionBody(const Eigen::Matrix3Xd& rest_joints, const FeetTarget& feet,
                                const ActionScript& script, const ActionPath& path,
                                double path_end_s, const ActionBodyOptions& options,
                                std::vector<BodyFrame>& frames);

/// All terms on the body in one frame of an action: 26 residuals.
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
