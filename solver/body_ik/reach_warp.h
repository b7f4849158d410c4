// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "generator/matching/foot_lock.h"
#include "geometry/body/skeleton.h"
#include "solver/body_ik/frame_pose.h"
#include "solver/terms/body/goal_terms.h"
#include "solver/terms/body/posture_terms.h"

namespace holdfast {

/// A captured reach that is warped to another goal.
struct ReachWarp {
  Eigen::Vector3d goal = Eigen::Vector3d::Zero();  ///< of the wrist joint, world, meters
  int frame = 0;                                   ///< of arrival at the goal
  int begin = 0, end = 0;  ///< frames [begin, end) that may change, including `frame`
  Side wrist = Side::kRight;
  /// The wrist stays at the goal after `frame`, and the change does not vanish at the end: for
  /// motions that end there.
  bool rests = false;
};

struct ReachWarpOptions {
  /// Maximum angle of each joint, radians; captured frames beyond it may stay there.
  std::array<double, kNumBodyJoints> joint_limits = {};
  int knot_frames = 5;           ///< spacing of the spline's control points
  double goal_sigma_m = 0.0005;  ///< at `frame`
  double rest_sigma_m = 0.003;   ///< after it, if the wrist rests
  double path_sigma_m = 0.02;    ///< on the way
  int max_iterations = 25;
  /// Given: a body that rests at the end, but off balance there, moves over its feet.
  const SolePoints* soles = nullptr;
};

struct ReachWarpReport {
  double wrist_error_m = 0.0;  ///< at `frame`, after placing the legs
  double max_missed_m = 0.0;   ///< of an ankle
  int iterations = 0;
  bool converged = false;
};

/// Changes trunk, arm and head such that the wrist is at the goal at `frame`: its captured path is
/// displaced by a minimum-jerk fraction of its error, which rises to 1 at `frame` and then falls,
/// or stays. The change is a cubic B-spline over time that vanishes at both ends with its first two
/// derivatives, which avoids jumps and keeps captured detail. It is solved by least squares over
/// all frames at once (Ceres): WristGoal, Gaze, LegReach, Balance, JointRange and a prior. Feet are
/// exactly at `feet`: the legs follow by two-bone inverse kinematics.
///
/// `frames` and `feet` are whole motions; only frames [begin, end) change. Throws Error if the
/// window has less than 3 knots on either side of `frame` (only before it if the wrist rests).
ReachWarpReport WarpReach(const Eigen::Matrix3Xd& rest_joints, const std::vector<FeetTarget>& feet,
                          const ReachWarp& warp, const ReachWarpOptions& options,
                          std::vector<BodyFrame>& frames);

/// All terms on one frame of a reach: 20 residuals.
struct ReachFrameTerms {
  WristGoal wrist;
  Gaze gaze;
  LegReach legs;
  Balance balance;
  JointRange range;

  auto Tied() const { return std::tie(wrist, gaze, legs, balance, range); }
};
using ReachFrameBlock = FrameBlock<ReachFrameTerms>;

/// Changes trunk, collarbone and arm minimally to place the wrist at `target` (world, meters):
/// minimizes |wrist(x) - target|^2 / (5 mm)^2 + sum_k x_k^2 / w_k over 16 angles, with shoulder and
/// elbow moving most. Zero if the wrist is there already, and smooth in target and frame. The elbow
/// stays bent by at least 3 degrees. Returns the remaining distance, meters: a target out of reach
/// is approached.
double PlaceWrist(const Eigen::Matrix3Xd& rest_joints, Side side, const Eigen::Vector3d& target,
                  BodyFrame& frame);

}  // namespace holdfast
