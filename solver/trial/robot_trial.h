// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "solver/robot/transfer_to_robot.h"
#include "solver/trial/trial.h"

namespace holdfast {

/// The frame in which the human hand touches with most of its parts; the first of several.
int FullestFrame(const HumanDemonstration& demonstration);

/// Whether a robot's hand keeps the object: its links as hulls, joints as springs where they stand,
/// the trial otherwise that of human hands (TryHold). Nothing for hands with sliding joints. Throws
/// Error without MuJoCo.
std::optional<HoldTrial> TryRobotHold(const RobotTransferSetup& setup, const RobotPose& pose,
                                      const TrialSolid& solid, const TrialProtocol& protocol);

/// The same of the human hand that the robot's was made from, in a frame of `clip`, which is the
/// scene's that `setup` was prepared for.
HoldTrial TryHumanHold(const RobotTransferSetup& setup, const Clip& clip, int frame,
                       const TrialSolid& solid, const TrialProtocol& protocol);

}  // namespace holdfast
