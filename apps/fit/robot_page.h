// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "solver/robot/robot_measures.h"
#include "solver/robot/transfer_to_robot.h"

namespace holdfast::apps {

/// The page of a clip on a robot's hand: how well contacts are kept, over the frames, the sheet of
/// pictures (`sheet`, a file beside the page), each joint's path within its limits, and which link
/// stands for which part of a hand.
std::string RobotPage(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                      const RobotMeasures& measures, const std::string& sheet);

}  // namespace holdfast::apps
