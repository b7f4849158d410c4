// SPDX-License-Identifier: MIT
#pragma once

#include <numbers>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "generator/matching/sole_contact.h"

namespace holdfast {

/// Toes near the ground do not point into it: they bend up until they are level, all of it while
/// the ball is less than 3 cm above the ground and nothing from 10 cm on, as under a heel that is
/// raised. Tips that point down would brush the ground in the next step. `share` of the bend is
/// made, and so much of it that toes are not farther than `most_rad` from their rest afterwards.
void LevelToes(const Eigen::Matrix3Xd& rest_joints, const SolePoints& soles, double share,
               BodyFrame& frame, double most_rad = std::numbers::pi);

}  // namespace holdfast
