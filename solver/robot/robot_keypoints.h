// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "solver/robot/human_demonstration.h"
#include "solver/robot/robot_anatomy.h"
#include "solver/robot/robot_term.h"

namespace holdfast {

/// A place on a robot's hand that a human joint or fingertip stands for.
struct RobotKeypoint {
  int link = 0;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< in the link's frame

  Eigen::Vector3d At(const PosedRobot& robot) const { return robot.ObjectFromLink(link) * point; }
};

/// Places of a robot's hand for palm, finger joints and fingertips, and the human's that they stand
/// for, in the object's frame.
struct RobotKeypoints {
  RobotKeypoints(const RobotHand& hand, const RobotAnatomy& anatomy);

  RobotKeypoint palm;                 ///< middle of the knuckles
  std::vector<RobotKeypoint> joints;  ///< three of each finger, RobotAnatomy::fingers' order
  std::vector<RobotKeypoint> tips;    ///< of each finger
  std::vector<int> human_fingers;     ///< that they stand for (Finger)

  Eigen::Matrix3Xd HumanTips(const HumanFrame& frame) const;
  Eigen::Matrix3Xd HumanJoints(const HumanFrame& frame) const;
};

}  // namespace holdfast
