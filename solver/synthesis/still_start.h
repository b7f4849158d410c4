// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/clip/clip.h"

namespace holdfast {

/// Leaves out frames at the start in which nothing happens yet: networks are given four key frames
/// of somebody who stands still, and then wait as the scripts did. Of the frames in which the right
/// hand is within 2 cm of where it was and turned by less than 8 degrees, so many stay, evenly, as
/// make 0.3 s; the first is one of them. Leaves a clip as it is in which the hand never leaves.
/// Returns how many were left out.
int LeaveOutStill(const Eigen::Matrix3Xd& rest_joints, Clip& clip);

}  // namespace holdfast
