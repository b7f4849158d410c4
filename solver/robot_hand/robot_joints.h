// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "solver/robot_hand/robot_hand.h"

namespace holdfast {

/// A joint as a robot's file has it, before followers are resolved.
struct RobotJointSource {
  std::string name;
  std::string follows;  ///< another joint's name; empty: it moves on its own
  double factor = 1.0, offset = 0.0;
  double low = 0.0, high = 0.0;
};

/// Gives the links (with `joint` and `kind` set) their numbers: one for each joint that moves on
/// its own, with bounds narrowed to what its followers allow. Joints without range stand still;
/// bounds wider than a turn or a metre are narrowed, with a note. Throws Error (`hand.source`) for
/// a joint that follows itself or one that is not there, for numbers that are not finite, a lower
/// bound above the upper, and bounds that leave nothing.
void ResolveJoints(std::vector<RobotJointSource> joints, RobotHand& hand);

}  // namespace holdfast
