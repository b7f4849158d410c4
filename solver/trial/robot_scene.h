// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "solver/robot/transfer_to_robot.h"
#include "solver/trial/trial.h"

namespace holdfast {

/// Writes a robot hand and its object as a scene for MuJoCo, with meshes in `x_assets` beside
/// "x.xml", to be run in MuJoCo's own loop:
/// - the hand is a free body that a weld pulls to the mocap body `wrist_target` (contacts ignore a
///   mocap body's velocity: a carried object would be left behind);
/// - joints have limits, couplings and position actuators; arm joints are rigid;
/// - the object is free, with the mass and convex pieces of a trial (TrialProtocol);
/// - one key frame per frame: poses, position of `wrist_target`, and actuator targets. In frames of
///   the hold these exceed the pose by what the squeeze of a trial (BalancePresses) requires.
/// The files do not depend on `threads`. Throws Error for an object without volume.
void WriteRobotScene(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                     const std::filesystem::path& path, int threads = 1);

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
