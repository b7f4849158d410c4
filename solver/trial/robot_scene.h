// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <vector>

#include <Eigen/Core>

#include "solver/robot/transfer_to_robot.h"
#include "solver/trial/trial.h"

namespace holdfast {

/// A robot's hand and what it holds as a scene for MuJoCo, meshes in `x_assets` beside "x.xml",
/// made to be played in MuJoCo's own loop:
///   - the hand is a free body that a weld draws after the mocap body `wrist_target` (velocities of
///     a mocap body itself do not reach its contacts: what it carries would be left behind);
///   - joints have limits, couplings and position actuators; joints of an arm are rigid;
///   - the object is free, its mass and convex pieces those of a trial (TrialProtocol);
///   - a key frame for each frame: poses, where `wrist_target` is, and where actuators pull. In
///     frames of the hold they pull past the pose, by what the squeeze of a trial (GripOfRobot)
///     takes.
/// The same files on any number of threads. Throws Error for an object without volume.
void WriteRobotScene(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                     const std::filesystem::path& path, int threads = 1);

/// The squeeze of a robot's hand on the object: where its links are closer than `protocol.touch_m`
/// (the nearest place of each), pressed by `BalancePresses`. `link` is the robot's; points and
/// forces are in its root's frame.
std::vector<GripContact> GripOfRobot(const RobotTransferSetup& setup, const RobotPose& pose,
                                     const TrialSolid& solid, const TrialProtocol& protocol);

/// What joints have to exert for these presses, a number of the hand each: N m, or N of sliding
/// ones.
Eigen::VectorXd GripTorques(const RobotHand& robot, const Eigen::VectorXd& q,
                            const std::vector<GripContact>& contacts);

}  // namespace holdfast
