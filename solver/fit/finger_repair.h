// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/clip/clip.h"
#include "geometry/rotation.h"
#include "solver/hand/hand_axes.h"

namespace holdfast {

/// A finger joint that turns by more than this from one frame to the next jumps, radians.
inline constexpr double kFingerJump = 40.0 * kDegree;

/// What became of one hand's fingers.
struct FingerRepair {
  Side side = Side::kRight;
  bool moves = false;   ///< a finger turns somewhere; hands that were not captured do not
  int jump_frames = 0;  ///< frames into which a finger joint jumped
  int replaced = 0;     ///< rotations of finger joints that were replaced, of 15 a frame
};

/// Frames, from 1, into which a finger joint of this hand jumps.
int FingerJumpFrames(const Clip& clip, Side side);

/// Brings fingers that jump to rest; `axes` are of the hand that is repaired in `clip`. A capture's
/// solver that finds another posture for a while leaves bursts and steps, and what filters them
/// overshoots beside them. Of every joint the most frames are kept that agree with one another,
///
///   angle(q_s, q_t) <= w (t - s)   for kept frames s < t that follow each other,
///
/// w 1200 degrees a second and at most 30 a frame (found over all frames at once, by dynamic
/// programming); others go the shortest way from kept frame to kept frame. Then every angle a of
/// the hand (HandAxes) is the least of
///
///   sum_t c_t (a_t - d_t)^2 + v (a_{t+1} - 2 a_t + a_{t-1})^2 + 10 max(0, a_t beyond its range)^2
///
/// d what the clip has now, c 1 for kept frames and 0.1 for others, v for a smoothing length of two
/// frames at 60 Hz. A hand without jumps stays as it is.
FingerRepair RepairFingers(const HandAxes& axes, Clip& clip);

}  // namespace holdfast
