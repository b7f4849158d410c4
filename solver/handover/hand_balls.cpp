// SPDX-License-Identifier: MIT
#include "solver/handover/hand_balls.h"

#include <array>
#include <utility>

namespace holdfast {

Eigen::Matrix4Xd HandBalls(const HandAnatomy& anatomy, const FingerPose& fingers) {
  constexpr double kPalmRadius = 0.012;  // metres: half as thick as a palm
  constexpr std::array<double, 4> kAlong = {0.3, 0.55, 0.8, 1.0};
  HandEvaluation evaluation = AtWrist(anatomy.hand);
  Eigen::Matrix3Xd centers;
  BallCenters(anatomy.landmarks, evaluation.At(fingers.data(), false).Vertices(), centers);
  const Eigen::Index in_fingers = centers.cols();
  Eigen::Matrix4Xd balls(4, in_fingers + 4 * kThumb);
  for (Eigen::Index b = 0; b < in_fingers; ++b) {
    balls.col(b) << centers.col(b), anatomy.landmarks.Balls()[b].radius;
  }
  for (int k = 0; k < 4 * kThumb; ++k) {
    balls.col(in_fingers + k) << kAlong[k % 4] * anatomy.axes.RestJoints().col(3 * (k / 4)),
        kPalmRadius;
  }
  return balls;
}

Eigen::Matrix4Xd MovedBalls(const Eigen::Isometry3d& by, Eigen::Matrix4Xd balls) {
  balls.topRows<3>() = (by * balls.topRows<3>()).eval();
  return balls;
}

}  // namespace holdfast
