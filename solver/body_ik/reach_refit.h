// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "generator/scripted/reach_motion.h"
#include "generator/wandr/pose.h"
#include "generator/wandr/rollout.h"
#include "geometry/body/skeleton.h"

namespace holdfast {

/// Where the wrist is to be exactly.
struct RefitGoal {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< world, meters
  int frame = 0;
  /// The motion ends here: from the frame on the wrist stays, and time slows down until both feet
  /// stand still.
  bool rests = false;
};

struct RefitOptions {
  Side wrist = Side::kRight;
  bool pin_feet = true;
  bool place_wrist = true;
  bool lift_hands = true;
  /// Arms swing on the way (SwingArms), feet are lifted (LiftFeet), nobody leans back
  /// (StraightenTrunk).
  bool walks = true;
  /// A goal farther than this from the wrist is left alone: the motion did not reach it.
  double farthest_m = 0.10;
  int window_frames = 30;  ///< that change on either side of a goal; all after one that rests
};

struct RefitReport {
  double max_foot_correction_m = 0.0;  ///< of a planted foot
  double max_pelvis_sink_m = 0.0;
  std::vector<double> wrist_errors_m;  ///< at the goals' frames, afterwards
  double max_hand_bend_rad = 0.0;      ///< of a wrist, to keep a hand off the floor
};

/// The last touch to a motion that a network made: nobody leans back (StraightenTrunk), arms swing
/// and feet are lifted on the way, toes near the ground are level (LevelToes), planted feet stay
/// where they are (LockFeet), the wrist is where it should be to the millimeter (WarpReach) and
/// stays at a last goal, hands bend at the wrist before their fingers go through the floor (as far
/// as wrists bend). Changes that much and no more: what the motion is comes from the network.
///
/// `states` (135 x F) at 30 fps, floor z = 0, of the body of `measures`. Throws Error for frames
/// that the motion does not have.
wandr::StateMatrix<double> RefitReach(const BodyMeasures& measures,
                                      const Eigen::Ref<const wandr::StateMatrix<double>>& states,
                                      std::span<const RefitGoal> goals,
                                      const RefitOptions& options = {},
                                      RefitReport* report = nullptr);

/// RefitReach of a rollout in place, joints as well. `reached`: the goals that it reached and the
/// frames in which it was closest; the wrist is put there in the nearest frame that leaves it time
/// to come and go, also where pinning the feet took it away by some centimeters.
RefitReport RefitRollout(const BodyMeasures& measures, std::span<const RefitGoal> reached,
                         Side wrist, wandr::RolloutTrack& track);

}  // namespace holdfast
