// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "generator/matching/leg_placement.h"
#include "geometry/body/skeleton.h"
#include "solver/body_ik/frame_pose.h"
#include "solver/terms/body/goal_terms.h"
#include "solver/terms/body/posture_terms.h"

namespace holdfast {

/// A captured reach carried to another goal.
struct ReachWarp {
  Eigen::Vector3d goal = Eigen::Vector3d::Zero();  ///< of the wrist joint, world, meters
  int frame = 0;                                   ///< at which it is there
  int begin = 0, end = 0;  ///< frames [begin, end) that may change, `frame` among them
  Side wrist = Side::kRight;
  /// From `frame` on the wrist stays at the goal, and the change does not vanish at the end: for
  /// motions that end there.
  bool rests = false;
};

struct ReachWarpOptions {
  /// Greatest angle of each joint, radians; captured frames that go beyond may stay there.
  std::array<double, kNumBodyJoints> joint_limits = {};
  int knot_frames = 5;           ///< distance of the spline's control points
  double goal_sigma_m = 0.0005;  ///< at the frame itself
  double rest_sigma_m = 0.003;   ///< after it, where the wrist rests
  double path_sigma_m = 0.02;    ///< on the way
  int max_iterations = 25;
};

struct ReachWarpReport {
  double wrist_error_m = 0.0;  ///< at the frame, after the legs followed
  double max_missed_m = 0.0;   ///< of an ankle
  int iterations = 0;
  bool converged = false;
};

/// Changes trunk, arm and head so that the wrist is at the goal at the frame: its captured path is
/// moved by a minimum-jerk share of what it lacks, rising to all of it at the frame and falling
/// back, or staying. The change is a cubic B-spline over time that vanishes at both ends with its
/// first two derivatives, so that nothing jumps and captured detail stays; it is found by least
/// squares over all frames at once (Ceres): WristGoal, Gaze, LegReach, Balance, JointRange and a
/// prior. Feet are where `feet` says, exactly: the legs follow by two-bone inverse kinematics.
///
/// `frames` and `feet` are whole motions; frames outside [begin, end) are not touched. Throws Error
/// when the window is shorter than 4 knots on either side of the frame (before it, where it rests).
ReachWarpReport WarpReach(const Eigen::Matrix3Xd& rest_joints, const std::vector<FeetTarget>& feet,
                          const ReachWarp& warp, const ReachWarpOptions& options,
                          std::vector<BodyFrame>& frames);

/// All that is asked of one frame of a reach: 20 residuals.
struct ReachFrameTerms {
  WristGoal wrist;
  Gaze gaze;
  LegReach legs;
  Balance balance;
  JointRange range;

  auto Tied() const { return std::tie(wrist, gaze, legs, balance, range); }
};
using ReachFrameBlock = FrameBlock<ReachFrameTerms>;

}  // namespace holdfast
