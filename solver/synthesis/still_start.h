// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/clip/clip.h"

namespace holdfast {

/// Leaves out key frames at the start in which nothing happens yet: networks are given four of
/// somebody who stands still, and then wait as the scripts did. The first one stays, and the last
/// in which the right hand is within 2 cm of where it was and turned by less than 8 degrees; what
/// it holds begins to move in between. Leaves a clip as it is in which the hand never leaves.
/// Returns how many were left out.
int LeaveOutStill(const Eigen::Matrix3Xd& rest_joints, Clip& keys);

}  // namespace holdfast
