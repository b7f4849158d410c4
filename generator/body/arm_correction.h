// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/skeleton.h"

namespace holdfast {

/// Moves a wrist to a world pose near the one it has, changing shoulder, elbow and wrist joint
/// only, and those by little: the elbow bends about the axis it is bent about until the distance
/// fits, the whole arm swings about the shoulder by the least rotation that brings the wrist there,
/// and the wrist joint takes what is left of the rotation. Exact when the target is in reach;
/// otherwise the wrist comes as near as the arm is long, with the rotation asked for.
///
/// `rest_joints` (3 x 55); `pose` and `trans` as in a clip. Returns the distance that is missing,
/// metres.
double MoveWrist(const Eigen::Matrix3Xd& rest_joints, Side side, const Eigen::Matrix3d& rotation,
                 const Eigen::Vector3d& position, const Eigen::Vector3d& trans, JointPose& pose);

}  // namespace holdfast
