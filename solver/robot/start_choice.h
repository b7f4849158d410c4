// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "solver/robot/transfer_to_robot.h"

namespace holdfast {

/// Which of the poses that the starts led to is taken: the least of cost (1 + give / 20 mm), of
/// those that cost at most three times the least. The give is how far the object's own weight moves
/// it in that grip (RobotHold). Returns its index.
int ChooseStart(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                const std::vector<double>& costs);

}  // namespace holdfast
