// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "solver/hand/hand_axes.h"
#include "solver/robot/human_demonstration.h"
#include "solver/robot/robot_anatomy.h"
#include "solver/robot/robot_term.h"

namespace holdfast {

/// human_wrist_from_root: the robot's palm laid on the human's, knuckles on knuckles, axes along
/// axes. Where a robot's hand is that follows the human wrist.
Eigen::Isometry3d WristFromRoot(const HandAxes& axes, const RobotHand& robot,
                                const RobotAnatomy& anatomy);

/// Poses to begin from: the palm on the human's and tilted, drawn back from the object and not,
/// fingers straight, half bent and nearly closed.
std::vector<RobotPose> RobotStarts(const HumanFrame& frame,
                                   const Eigen::Isometry3d& wrist_from_root, const RobotHand& robot,
                                   const RobotAnatomy& anatomy);

}  // namespace holdfast
