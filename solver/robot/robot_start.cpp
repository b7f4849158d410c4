// SPDX-License-Identifier: MIT
#include "solver/robot/robot_start.h"

#include <array>

#include "geometry/pose.h"
#include "geometry/rotation.h"

namespace holdfast {

Eigen::Isometry3d WristFromRoot(const HandAxes& axes, const RobotHand&,
                                const RobotAnatomy& anatomy) {
  Eigen::Matrix3d wrist_from_axes;
  wrist_from_axes << axes.Forward(), axes.Across(), axes.PalmNormal();
  Eigen::Vector3d knuckles = Eigen::Vector3d::Zero();
  int fingers = 0;
  for (const RobotFinger& finger : anatomy.fingers) {
    if (finger.human == kThumb) continue;
    knuckles += axes.RestJoints().col(3 * finger.human);
    ++fingers;
  }
  knuckles /= fingers;
  return PoseAt(wrist_from_axes * anatomy.root_from_axes.transpose(), anatomy.knuckles, knuckles);
}

std::vector<RobotPose> RobotStarts(const HumanFrame& frame,
                                   const Eigen::Isometry3d& wrist_from_root, const RobotHand& robot,
                                   const RobotAnatomy& anatomy) {
  constexpr std::array<double, 3> kBent = {0.15, 0.45, 0.75};
  constexpr std::array<double, 3> kTilts = {0.0, 25.0 * kDegree, -25.0 * kDegree};
  constexpr std::array<double, 2> kBack_m = {0.0, 0.03};
  const Eigen::Isometry3d laid = frame.object_from_wrist * wrist_from_root;
  std::vector<RobotPose> starts;
  for (const double bent : kBent) {
    const Eigen::VectorXd q = robot.Straight() + bent * (anatomy.closed - robot.Straight());
    for (const double back : kBack_m) {
      for (int axis = 0; axis < 3; ++axis) {
        for (const double tilt : kTilts) {
          if (tilt == 0.0 && axis > 0) continue;
          const Eigen::Matrix3d turn =
              Eigen::AngleAxisd(tilt, anatomy.root_from_axes.col(axis)).toRotationMatrix();
          const Eigen::Vector3d place = anatomy.knuckles - back * anatomy.root_from_axes.col(2);
          const Eigen::Isometry3d pose = laid * PoseAt(turn, anatomy.knuckles, place);
          starts.push_back({pose.linear(), pose.translation(), q});
        }
      }
    }
  }
  return starts;
}

}  // namespace holdfast
