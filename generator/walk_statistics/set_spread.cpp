// SPDX-License-Identifier: MIT
#include "generator/walk_statistics/set_spread.h"

#include <algorithm>
#include <limits>

namespace holdfast {

double SetSpread(std::span<const std::vector<BodyFrame>> motions,
                 const Eigen::Matrix3Xd& rest_joints) {
  using Joints = Eigen::Matrix<double, 3, kNumBodyJoints>;
  std::vector<std::vector<Joints>> placed;
  for (const std::vector<BodyFrame>& motion : motions) {
    if (motion.empty()) continue;
    PlanarMove move;
    move.yaw_rad = -Yaw(motion.front());
    move.shift = -(Eigen::Rotation2Dd(move.yaw_rad) * motion.front().pelvis.head<2>());
    std::vector<Joints> joints;
    for (const BodyFrame& frame : motion) joints.push_back(Place(rest_joints, move * frame).joints);
    placed.push_back(std::move(joints));
  }
  double sum = 0.0;
  int pairs = 0;
  for (std::size_t i = 0; i < placed.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j, ++pairs) {
      const std::size_t frames = std::max(placed[i].size(), placed[j].size());
      double distance = 0.0;
      for (std::size_t t = 0; t < frames; ++t) {
        const Joints& a = placed[i][std::min(t, placed[i].size() - 1)];
        const Joints& b = placed[j][std::min(t, placed[j].size() - 1)];
        distance += (a - b).colwise().norm().mean();
      }
      sum += distance / static_cast<double>(frames);
    }
  }
  return pairs == 0 ? std::numeric_limits<double>::quiet_NaN() : sum / pairs;
}

}  // namespace holdfast
