// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "solver/robot/transfer_to_robot.h"
#include "solver/trial/trial.h"

namespace holdfast {

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
