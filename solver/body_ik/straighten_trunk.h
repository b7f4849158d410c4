// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"

namespace holdfast {

/// Nobody who stands or walks leans back by more than 3 degrees (LeanBack): beyond that the spine
/// bends forward, by 20 degrees at most and evenly over time; the head stays turned as it is, arms
/// go with the trunk. The first frame is left as it is (FadeIn).
void StraightenTrunk(const Eigen::Matrix3Xd& rest_joints, std::vector<BodyFrame>& frames);

}  // namespace holdfast
