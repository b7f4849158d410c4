// SPDX-License-Identifier: MIT
#include "solver/trial/robot_grip.h"

#include <algorithm>

namespace holdfast {

std::vector<TrialContact> GripOfRobot(const RobotTransferSetup& setup, const RobotPose& pose,
                                      const TrialSolid& solid, const TrialProtocol& protocol) {
  constexpr double kGridError_m = 0.005;
  PosedRobot posed(setup.robot);
  posed.Set(pose);
  const Eigen::Isometry3d root_from_object = pose.ObjectFromRoot().inverse();
  std::vector<TrialContact> contacts;
  for (const int link : setup.solids->Links()) {
    double least = protocol.touch_m;
    TrialContact contact;
    for (const auto sample : setup.solids->Of(link).samples.colwise()) {
      const Eigen::Vector3d point = posed.ObjectFromLink(link) * sample;
      if (setup.object_grid->Linear(point) > least + kGridError_m) continue;
      const SignedDistance::Result hit = setup.object_distance->Query(point);
      if (hit.distance >= least) continue;
      least = hit.distance;
      contact = {link, root_from_object * hit.closest, -(root_from_object.linear() * hit.gradient),
                 Eigen::Vector3d::Zero()};
    }
    if (least < protocol.touch_m) contacts.push_back(contact);
  }
  BalancePresses(root_from_object * solid.mass.centre, solid.radius_m, protocol.scene.friction,
                 std::max(protocol.least_grip_N,
                          protocol.grip_weights * solid.mass.mass_kg * protocol.gravity_m_s2),
                 contacts);
  return contacts;
}

Eigen::VectorXd GripTorques(const RobotHand& robot, const Eigen::VectorXd& q,
                            const std::vector<TrialContact>& contacts) {
  RobotState state(robot);
  state.Evaluate(q);
  Eigen::VectorXd torques = Eigen::VectorXd::Zero(robot.NumDofs());
  for (const TrialContact& contact : contacts) {
    torques += state.PointJacobian(contact.link, contact.point).transpose() * contact.press;
  }
  return torques;
}

}  // namespace holdfast
