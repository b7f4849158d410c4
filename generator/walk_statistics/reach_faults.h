// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"

namespace holdfast {

/// Angle of pelvis to neck from the vertical in the plane of the heading `yaw_rad`, radians;
/// negative forwards.
double LeanBack(const BodyPlacement& placed, double yaw_rad);

/// What an eye sees at once in a reach, and means over frames do not show. Frames at 30 Hz, the
/// ground z = 0.
struct ReachFaults {
  /// Into how many frames the second crouch falls that is not the first one's end: the pelvis sinks
  /// by 12 cm below the highest it has been, rises by 6 cm or more but not to within 6 cm of that
  /// height, and sinks by 6 cm again. -1: never. Heights are means of 5 frames, so that a walk's
  /// bob (4 cm) does not count.
  int second_crouch = -1;
  /// Greatest lean backwards, radians, that is kept up for 10 frames while waiting: the pelvis
  /// makes less than 0.1 m/s over 21 frames. NaN for who never waits.
  double lean_back_rad = 0.0;

  bool CrouchesTwice() const { return second_crouch >= 0; }
  bool LeansBack() const;  ///< by more than 10 degrees
};

/// ReachFaults::second_crouch of a pelvis at these heights, meters.
int SecondCrouch(std::span<const double> heights);

ReachFaults FindReachFaults(std::span<const BodyFrame> frames, const Eigen::Matrix3Xd& rest_joints);

}  // namespace holdfast
