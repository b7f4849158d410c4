// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "geometry/body/skeleton.h"

namespace holdfast {

/// Nobody who stands or walks leans back by more than 3 degrees (LeanBack): beyond that the spine
/// bends forward, by 20 degrees at most and evenly over time; the head stays turned as it is, arms
/// go with the trunk. The first frame is left as it is (FadeIn).
void StraightenTrunk(const Eigen::Matrix3Xd& rest_joints, std::vector<BodyFrame>& frames);

/// Trunk, collarbone and arm changed by as little as it takes to put the wrist on `target` (world,
/// meters): x of least |wrist(x) - target|^2 / (5 mm)^2 + sum_k x_k^2 / w_k over 16 angles,
/// shoulder and elbow moving most. Zero where the wrist is there already, and smooth in target and
/// frame. The elbow keeps bent by 3 degrees at least. Returns how far the wrist stays from it,
/// meters: a target out of reach is approached.
double PlaceWrist(const Eigen::Matrix3Xd& rest_joints, Side side, const Eigen::Vector3d& target,
                  BodyFrame& frame);

}  // namespace holdfast
