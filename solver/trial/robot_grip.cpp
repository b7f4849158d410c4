// SPDX-License-Identifier: MIT
#include "solver/trial/robot_grip.h"

#include <algorithm>

#include "solver/robot/robot_hold.h"

namespace holdfast {

std::vector<GripContact> GripOfRobot(const RobotTransferSetup& setup, const RobotPose& pose,
                                     const TrialSolid& solid, const TrialProtocol& protocol) {
  PosedRobot posed(setup.robot);
  posed.Set(pose);
  std::vector<GripContact> contacts = TouchesOfRobot(setup, posed, protocol.touch_m);
  BalancePresses(pose.ObjectFromRoot().inverse() * solid.mass.centre, solid.radius_m,
                 protocol.scene.friction,
                 std::max(protocol.least_grip_N,
                          protocol.grip_weights * solid.mass.mass_kg * protocol.gravity_m_s2),
                 contacts);
  return contacts;
}

Eigen::VectorXd GripTorques(const RobotHand& robot, const Eigen::VectorXd& q,
                            const std::vector<GripContact>& contacts) {
  RobotState state(robot);
  state.Evaluate(q);
  Eigen::VectorXd presses(3 * std::ssize(contacts));
  for (Eigen::Index c = 0; c < std::ssize(contacts); ++c) {
    presses.segment<3>(3 * c) = contacts[static_cast<std::size_t>(c)].press;
  }
  return ContactSlopes(state, contacts).transpose() * presses;
}

}  // namespace holdfast
