// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "solver/grip/grip.h"
#include "solver/robot/transfer_to_robot.h"

namespace holdfast {

/// Returns one contact per link that is closer to the object than `touch_m`: the nearest point, in
/// the root's frame, with zero force. `link` is the robot's link index.
std::vector<GripContact> TouchesOfRobot(const RobotTransferSetup& setup, const PosedRobot& posed,
                                        double touch_m);

/// Jacobian of the contact points with respect to q: 3 rows per contact, root's frame.
Eigen::MatrixXd ContactSlopes(const RobotState& state, const std::vector<GripContact>& contacts);

/// Grasp stability of a robot hand in any pose, by the compliance model of GripGive: links closer
/// than 3 mm press with a total of 8 object weights, at least 10 N; the object is solid with 500
/// kg/m^3, 0.05 to 0.5 kg; joints are springs of 3 N m per radian, or 1 N per millimeter; friction
/// is 0.6. Built once per setup, which must outlive it.
class RobotHold {
 public:
  explicit RobotHold(const RobotTransferSetup& setup);
  /// Object displacement in the grasp under its own weight, meters; decimeters if it falls.
  double Give_m(const PosedRobot& posed) const;

 private:
  const RobotTransferSetup& setup_;
  GrippedSolid solid_;  // in the object's frame
  Eigen::VectorXd stiffness_;
};

}  // namespace holdfast
