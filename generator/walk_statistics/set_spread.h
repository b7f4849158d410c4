// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"

namespace holdfast {

/// How much motions of a set differ: the mean distance of a joint of two of them, over the 22
/// joints, over time and over all pairs, meters. Motions at one frame rate, each moved along the
/// ground and turned so that its first frames meet, all on the body of `rest_joints`; who ends
/// first stays where it is. NaN for fewer than two motions.
double SetSpread(std::span<const std::vector<BodyFrame>> motions,
                 const Eigen::Matrix3Xd& rest_joints);

}  // namespace holdfast
