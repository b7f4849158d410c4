// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "solver/robot/transfer_to_robot.h"
#include "solver/trial/trial.h"

namespace holdfast {

/// The first frame in which most parts of the human hand are in contact.
int FullestFrame(const HumanDemonstration& demonstration);

/// Tries whether a robot hand holds the object: links as hulls, joints as springs at their values,
/// otherwise the trial of human hands (TryHold). Nothing for hands with sliding joints. Throws
/// Error without MuJoCo.
std::optional<HoldTrial> TryRobotHold(const RobotTransferSetup& setup, const RobotPose& pose,
                                      const TrialSolid& solid, const TrialProtocol& protocol);

/// Tries the human hand that the robot's was derived from, in a frame of `clip`, which must be the
/// clip of `setup`'s scene.
HoldTrial TryHumanHold(const RobotTransferSetup& setup, const Clip& clip, int frame,
                       const TrialSolid& solid, const TrialProtocol& protocol);

}  // namespace holdfast
