// SPDX-License-Identifier: MIT
#pragma once

#include <array>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"

namespace holdfast {

/// Arms that have nothing else to do, frame by frame: they hang more than the motion has it, and
/// swing against the legs, each forward with the ankle of the other side, bending a little there.
/// `idle` (left, right; 0 to 1) says how much of it an arm does, `walks` (0 to 1) how much swing
/// there is. Smooth in all of them.
void SwingArms(const Eigen::Matrix3Xd& rest_joints, const std::array<double, 2>& idle, double walks,
               BodyFrame& frame);

}  // namespace holdfast
