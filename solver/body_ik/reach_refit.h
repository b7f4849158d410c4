// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "generator/scripted/reach_motion.h"
#include "generator/wandr/pose.h"
#include "generator/wandr/rollout.h"
#include "geometry/body/skeleton.h"

namespace holdfast {

/// A goal at which the wrist is placed exactly.
struct RefitGoal {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< world, meters
  int frame = 0;
  /// The motion ends here: after `frame` the wrist stays, and time slows down until both feet are
  /// still.
  bool rests = false;
};

struct RefitOptions {
  Side wrist = Side::kRight;
  bool pin_feet = true;
  bool place_wrist = true;
  bool lift_hands = true;
  /// Arms swing while walking (SwingArms), feet are lifted (LiftFeet), the trunk does not lean back
  /// (StraightenTrunk).
  bool walks = true;
  /// Goals farther from the wrist are ignored: the motion did not reach them.
  double farthest_m = 0.10;
  /// Likewise for goals that the arm reaches from where the body stands: shoulder to goal at most
  /// the arm's length and 5 cm more.
  double farthest_in_reach_m = 0.10;
  int window_frames = 30;  ///< that may change on either side of a goal; all after one that rests
};

struct RefitReport {
  double max_foot_correction_m = 0.0;  ///< of a planted foot
  double max_pelvis_sink_m = 0.0;
  std::vector<double> wrist_errors_m;  ///< at the goals' frames, after refitting
  double max_hand_bend_rad = 0.0;      ///< of a wrist, to keep a hand off the floor
};

/// Limits backward lean while standing or walking to 3 degrees (LeanBack): beyond that the spine
/// bends forward, by at most 20 degrees and smoothly over time; the head keeps its orientation,
/// arms move with the trunk. The first frame is unchanged (FadeIn).
void StraightenTrunk(const Eigen::Matrix3Xd& rest_joints, std::vector<BodyFrame>& frames);

/// Final correction of a generated motion: no leaning back (StraightenTrunk), swinging arms and
/// lifted feet while walking, level toes near the ground (LevelToes), pinned stance feet
/// (LockFeet), the wrist placed at its goals to the millimeter (WarpReach) and kept at a last one,
/// and hands bent up at the wrist (as far as wrists bend) before fingers penetrate the floor.
/// Everything else is kept from the network.
///
/// `states` (135 x F) at 30 fps, floor z = 0, of the body of `measures`. Throws Error for frames
/// that the motion does not have.
wandr::StateMatrix<double> RefitReach(const BodyMeasures& measures,
                                      const Eigen::Ref<const wandr::StateMatrix<double>>& states,
                                      std::span<const RefitGoal> goals,
                                      const RefitOptions& options = {},
                                      RefitReport* report = nullptr);

/// Applies RefitReach to a rollout in place, including joints. `goals`: with their closest frames.
/// The wrist is placed at those that the motion reaches, or comes so close to that raising the arm
/// suffices, in the nearest frame with enough time on both sides.
RefitReport RefitRollout(const BodyMeasures& measures, std::span<const RefitGoal> goals, Side wrist,
                         wandr::RolloutTrack& track);

}  // namespace holdfast
