// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/clip/clip.h"

namespace holdfast {

/// Makes the right hand's way to where it goes (HandWay) one movement: it gets faster, is fastest
/// before half of the time, and slows down until it is there, as hands of captured people do.
/// Networks' hands get faster and slower two or three times, from key frame to key frame. Frames
/// are shown earlier or later, those of the whole body with the hand: where the hand goes, how long
/// it takes and the number of frames stay. At most six times as fast as they were, where the
/// hand halts. Leaves a clip as it is in which the hand has no way.
void PaceHand(const Eigen::Matrix3Xd& rest_joints, Clip& clip);

}  // namespace holdfast
