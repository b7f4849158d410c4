// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "generator/scripted/reach_motion.h"

namespace holdfast {

/// Angle between the pelvis-neck line and the vertical, in the plane of the heading `yaw_rad`,
/// radians; negative forward.
double LeanBack(const BodyPlacement& placed, double yaw_rad);

/// Visible faults of a reach that means over frames do not show. Frames at 30 Hz, ground z = 0.
struct ReachFaults {
  /// Frame of a second crouch, or -1. The pelvis sinks by 12 cm below its highest position so far,
  /// rises by 6 cm or more but not to within 6 cm of that position, and sinks by 6 cm again.
  /// Heights are means of 5 frames, so that the vertical oscillation of a walk (4 cm) does not
  /// count.
  int second_crouch = -1;
  /// Maximum backward lean, radians, that lasts 10 frames while waiting: the pelvis moves at less
  /// than 0.1 m/s over 21 frames. NaN for a motion that never waits.
  double lean_back_rad = 0.0;
  /// OffBalance of the last frame, meters: NaN for a motion that does not end standing.
  double off_balance_m = 0.0;
};

/// Returns ReachFaults::second_crouch for a sequence of pelvis heights, meters.
int SecondCrouch(std::span<const double> heights);

ReachFaults FindReachFaults(std::span<const BodyFrame> frames, const BodyMeasures& measures);

}  // namespace holdfast
