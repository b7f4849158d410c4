// SPDX-License-Identifier: MIT
#include "solver/synthesis/still_start.h"

#include "geometry/body/body_model.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr double kStill_m = 0.02, kStill_rad = 8.0 * kDegree;

// The last frame up to which the right hand stays; the last one of all where it never leaves.
int LastStill(const Eigen::Matrix3Xd& rest_joints, const Clip& keys) {
  const auto wrist = [&](int t) {
    BodyState state;
    ForwardJoints(rest_joints, keys.pose[static_cast<std::size_t>(t)], keys.trans.col(t), state);
    return state.WorldFromJoint(kRightWrist);
  };
  const Eigen::Isometry3d first = wrist(0);
  int last = 0;
  for (int t = 1; t < keys.NumFrames(); ++t, ++last) {
    const Eigen::Isometry3d now = wrist(t);
    if ((now.translation() - first.translation()).norm() > kStill_m ||
        AngleBetween(now.linear(), first.linear()) > kStill_rad) {
      break;
    }
  }
  return last;
}

void Erase(Eigen::Index from, Eigen::Index count, Eigen::Matrix3Xd& columns) {
  const Eigen::Index left = columns.cols() - from - count;
  const Eigen::Matrix3Xd after = columns.rightCols(left);
  columns.conservativeResize(3, from + left);
  columns.rightCols(left) = after;
}

}  // namespace

int LeaveOutStill(const Eigen::Matrix3Xd& rest_joints, Clip& keys) {
  const int last = LastStill(rest_joints, keys);
  if (last < 2 || last + 1 >= keys.NumFrames()) return 0;
  const int count = last - 1;
  keys.pose.erase(keys.pose.begin() + 1, keys.pose.begin() + 1 + count);
  Erase(1, count, keys.trans);
  if (!keys.holding_hand.empty()) {
    keys.holding_hand.erase(keys.holding_hand.begin() + 1, keys.holding_hand.begin() + 1 + count);
  }
  if (keys.object) {
    Erase(1, count, keys.object->trans);
    Erase(1, count, keys.object->orient);
  }
  return count;
}

}  // namespace holdfast
