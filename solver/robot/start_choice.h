// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "solver/robot/transfer_to_robot.h"

namespace holdfast {

/// Which of the poses that the starts led to is taken: of those that cost at most half more than
/// the least, the cheapest whose touching links hold the object's weight in every direction by
/// little friction (`HoldsGravity`); the cheapest of all where none does. Returns its index.
int ChooseStart(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                const std::vector<double>& costs);

}  // namespace holdfast
