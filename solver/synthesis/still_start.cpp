// SPDX-License-Identifier: MIT
#include "solver/synthesis/still_start.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "geometry/body/body_model.h"
#include "geometry/clip/resample.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr double kStill_m = 0.02, kStill_rad = 8.0 * kDegree, kStays_s = 0.3;

// The last frame up to which the right hand stays; the last one of all where it never leaves.
int LastStill(const Eigen::Matrix3Xd& rest_joints, const Clip& clip) {
  const auto wrist = [&](int t) {
    BodyState state;
    ForwardJoints(rest_joints, clip.pose[static_cast<std::size_t>(t)], clip.trans.col(t), state);
    return state.WorldFromJoint(kRightWrist);
  };
  const Eigen::Isometry3d first = wrist(0);
  int last = 0;
  for (int t = 1; t < clip.NumFrames(); ++t, ++last) {
    const Eigen::Isometry3d now = wrist(t);
    if ((now.translation() - first.translation()).norm() > kStill_m ||
        AngleBetween(now.linear(), first.linear()) > kStill_rad) {
      break;
    }
  }
  return last;
}

}  // namespace

int LeaveOutStill(const Eigen::Matrix3Xd& rest_joints, Clip& clip) {
  const int last = LastStill(rest_joints, clip), count = clip.NumFrames();
  const int stay = std::max(1, static_cast<int>(std::lround(kStays_s * clip.frame_rate)));
  if (last <= stay || last + 1 >= count) return 0;
  std::vector<int> frames;
  for (int k = 0; k < stay; ++k) frames.push_back(k * last / stay);
  for (int t = last; t < count; ++t) frames.push_back(t);
  clip = TakeFrames(clip, frames);
  return count - clip.NumFrames();
}

}  // namespace holdfast
