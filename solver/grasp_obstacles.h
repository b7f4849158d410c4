// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "geometry/body_model.h"
#include "geometry/clip.h"

namespace holdfast {

/// The body as the wrist sees it in up to `num_frames` frames spread over a clip: vertices within
/// `reach_m` of the wrist, in its frame, metres (3 x n, one set a frame), without the hand and
/// forearm of `side` themselves. For GraspOptions::obstacles_in_wrist: an object that is carried
/// through the clip should not go through a leg on its way.
std::vector<Eigen::Matrix3Xd> BodyAroundWrist(const Clip& clip, const BodySurface& body, Side side,
                                              double reach_m, int num_frames = 8);

}  // namespace holdfast
