// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "solver/grip/grip.h"
#include "solver/robot/transfer_to_robot.h"

namespace holdfast {

/// Where links of a posed hand are closer to the object than `touch_m`, the nearest place of each:
/// in the root's frame, pressing with nothing yet. `link` is the robot's.
std::vector<GripContact> TouchesOfRobot(const RobotTransferSetup& setup, const PosedRobot& posed,
                                        double touch_m);

/// How the contacts' points move with the hand's numbers: 3 rows for each contact, root's frame.
Eigen::MatrixXd ContactSlopes(const RobotState& state, const std::vector<GripContact>& contacts);

/// How well a robot's hand holds the object, by our own model (GripGive), for any pose: links
/// closer than 3 mm press with 8 weights of the object in sum, at least 10 N; the object is filled
/// with 500 kg/m^3, 0.05 to 0.5 kg; joints are springs of 3 N m a radian, or 1 N a millimeter;
/// friction is 0.6. Made once for a setup, which must outlive it.
class RobotHold {
 public:
  explicit RobotHold(const RobotTransferSetup& setup);
  /// How far the object's own weight moves it in the grip, meters; decimeters where it falls.
  double Give_m(const PosedRobot& posed) const;

 private:
  const RobotTransferSetup& setup_;
  GrippedSolid solid_;  // in the object's frame
  Eigen::VectorXd stiffness_;
};

}  // namespace holdfast
