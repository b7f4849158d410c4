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

inline RobotKeypoints::RobotKeypoints(const RobotHand& hand, const RobotAnatomy& anatomy) {
  RobotState state(hand);
  state.Evaluate(hand.Straight());
  const auto add = [&](int link, const Eigen::Vector3d& in_root) {
    return RobotKeypoint{link, state.RootFromLink(link).inverse() * in_root};
  };
  const int palm_link = anatomy.palm_links.front();
  palm = add(palm_link, anatomy.knuckles);
  for (const RobotFinger& finger : anatomy.fingers) {
    human_fingers.push_back(finger.human);
    // A phalanx without links of its own moves with the one before.
    int last = palm_link;
    for (int p = 0; p < 3; ++p) {
      if (!finger.links[p].empty()) last = finger.links[p].front();
      joints.push_back(add(last, finger.nodes[p]));
      if (!finger.links[p].empty()) last = finger.links[p].back();
    }
    tips.push_back(add(last, finger.nodes[3]));
  }
}

inline Eigen::Matrix3Xd RobotKeypoints::HumanTips(const HumanFrame& frame) const {
  return frame.tips(Eigen::all, human_fingers);
}

inline Eigen::Matrix3Xd RobotKeypoints::HumanJoints(const HumanFrame& frame) const {
  Eigen::Matrix3Xd out(3, static_cast<Eigen::Index>(joints.size()));
  for (Eigen::Index i = 0; i < out.cols(); ++i) {
    out.col(i) = frame.joints.col(3 * human_fingers[static_cast<std::size_t>(i / 3)] + i % 3);
  }
  return out;
}

}  // namespace holdfast
