// SPDX-License-Identifier: MIT
#include "geometry/resample.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "geometry/error.h"
#include "geometry/rotation.h"

namespace holdfast {

Clip Resample(const Clip& clip, double frame_rate) {
  if (!(frame_rate > 0)) {
    throw Error("resampling", "a frame rate that is not positive", "Give frames per second");
  }
  const int frames = clip.NumFrames();
  if (frames == 0 || std::abs(frame_rate - clip.frame_rate) < 1e-9) return clip;
  const double step = clip.frame_rate / frame_rate;
  const int count = static_cast<int>(std::floor((frames - 1) / step + 1e-6)) + 1;
  Clip out = clip;
  out.frame_rate = frame_rate;
  out.trans.resize(3, count);
  out.pose.resize(count);
  const auto tracks = {std::pair{&clip.object, &out.object}, std::pair{&clip.table, &out.table}};
  for (const auto& [from, to] : tracks) {
    if (!*from) continue;
    (*to)->trans.resize(3, count);
    (*to)->orient.resize(3, count);
  }
  if (!clip.holding_hand.empty()) out.holding_hand.resize(count);
  std::vector<int> nearest(count);
  const auto between = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b, double f) {
    const Eigen::Matrix3d Ra = ExpSO3(a);
    if (f == 0) return a;
    const Eigen::Matrix3d R = Ra * ExpSO3(f * LogSO3(Ra.transpose() * ExpSO3(b)));
    return UnwrapAxisAngle(LogSO3(R), a);
  };
  for (int i = 0; i < count; ++i) {
    const double at = i * step;
    const int before = std::min(static_cast<int>(at + 1e-9), frames - 1);
    const int after = std::min(before + 1, frames - 1);
    double f = std::clamp(at - before, 0.0, 1.0);
    if (f < 1e-9) f = 0;
    out.trans.col(i) = (1 - f) * clip.trans.col(before) + f * clip.trans.col(after);
    for (int j = 0; j < kNumJoints; ++j) {
      out.pose[i].col(j) = between(clip.pose[before].col(j), clip.pose[after].col(j), f);
    }
    for (const auto& [from, to] : tracks) {
      if (!*from) continue;
      (*to)->trans.col(i) = (1 - f) * (*from)->trans.col(before) + f * (*from)->trans.col(after);
      (*to)->orient.col(i) = between((*from)->orient.col(before), (*from)->orient.col(after), f);
    }
    nearest[i] = f < 0.5 ? before : after;
    if (!clip.holding_hand.empty()) out.holding_hand[i] = clip.holding_hand[nearest[i]];
  }
  if (clip.contact) {
    if (clip.contact->object.size() > 0) {
      out.contact->object = clip.contact->object(Eigen::all, nearest);
    }
    if (clip.contact->body.size() > 0) out.contact->body = clip.contact->body(Eigen::all, nearest);
  }
  return out;
}

}  // namespace holdfast
