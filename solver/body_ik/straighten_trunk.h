// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "geometry/body/skeleton.h"

namespace holdfast {

/// Limits backward lean while standing or walking to 3 degrees (LeanBack): beyond that the spine
/// bends forward, by at most 20 degrees and smoothly over time; the head keeps its orientation,
/// arms move with the trunk. The first frame is unchanged (FadeIn).
void StraightenTrunk(const Eigen::Matrix3Xd& rest_joints, std::vector<BodyFrame>& frames);

/// Changes trunk, collarbone and arm minimally to place the wrist at `target` (world, meters):
/// minimizes |wrist(x) - target|^2 / (5 mm)^2 + sum_k x_k^2 / w_k over 16 angles, with shoulder and
/// elbow moving most. Zero if the wrist is there already, and smooth in target and frame. The elbow
/// stays bent by at least 3 degrees. Returns the remaining distance, meters: a target out of reach
/// is approached.
double PlaceWrist(const Eigen::Matrix3Xd& rest_joints, Side side, const Eigen::Vector3d& target,
                  BodyFrame& frame);

}  // namespace holdfast
