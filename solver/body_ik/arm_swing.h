// SPDX-License-Identifier: MIT
#pragma once

#include <array>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"

namespace holdfast {

/// Arms swing against the legs, frame by frame: each goes forward with the ankle of the other side
/// and bends a little there. `shares` (left, right; 0 to 1) says how much of it an arm does: none
/// for one that has something else to do. Smooth in the frame; nothing for who stands with the feet
/// side by side.
void SwingArms(const Eigen::Matrix3Xd& rest_joints, const std::array<double, 2>& shares,
               BodyFrame& frame);

}  // namespace holdfast
