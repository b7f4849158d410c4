// SPDX-License-Identifier: MIT
#include "generator/actions/action_path.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "generator/scripted/minimum_jerk.h"
#include "geometry/error.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

Isometry3d Between(const Isometry3d& a, const Isometry3d& b, double share) {
  return RigidTransform(
      Quaterniond(a.linear()).slerp(share, Quaterniond(b.linear())).toRotationMatrix(),
      (1.0 - share) * a.translation() + share * b.translation());
}

}  // namespace

Isometry3d PathPoint::At(const Isometry3d& head_pose) const {
  if (share <= 0.0) return world;
  const Isometry3d carried = head_pose * head;
  return share >= 1.0 ? carried : Between(world, carried, share);
}

ActionPath::ActionPath(std::vector<PathKey> keys, std::vector<Stroke> strokes)
    : keys_(std::move(keys)), strokes_(std::move(strokes)) {
  if (keys_.empty()) throw Error("action", "has no keys", "Give at least one key");
  for (std::size_t k = 0; k < keys_.size(); ++k) {
    const double before = k == 0 ? keys_[k].arrive_s : keys_[k - 1].leave_s;
    if (!(keys_[k].arrive_s >= before && keys_[k].leave_s >= keys_[k].arrive_s)) {
      throw Error("action", "has keys that are not sorted by time", "Sort keys by time");
    }
  }
}

PathPoint ActionPath::At(double time_s) const {
  std::size_t next = 0;
  while (next < keys_.size() && time_s >= keys_[next].arrive_s) ++next;
  const Isometry3d stroke = StrokeAt(time_s);
  PathPoint point;
  const auto put = [&](const PathKey& key, const Isometry3d& pose) {
    (key.anchor == Anchor::kHead ? point.head : point.world) = pose * stroke;
  };
  if (next == 0 || next == keys_.size() || time_s <= keys_[next - 1].leave_s) {
    const PathKey& at = keys_[next == 0 ? 0 : next - 1];
    point.share = at.anchor == Anchor::kHead ? 1.0 : 0.0;
    put(at, at.pose);
    return point;
  }
  const PathKey &from = keys_[next - 1], &to = keys_[next];
  const double tau = (time_s - from.leave_s) / (to.arrive_s - from.leave_s);
  const double share = MinimumJerk(tau);
  if (from.anchor == to.anchor) {
    point.share = from.anchor == Anchor::kHead ? 1.0 : 0.0;
    Isometry3d pose = Between(from.pose, to.pose, share);
    if (from.anchor == Anchor::kWorld) {
      pose.translation() += 4.0 * share * (1.0 - share) * to.bulge;
    }
    put(from, pose);
    return point;
  }
  put(from, from.pose);
  put(to, to.pose);
  point.share = to.anchor == Anchor::kHead ? share : 1.0 - share;
  // The bulge applies to the world part, which has weight (1 - share).
  point.world.translation() += 4.0 * (to.anchor == Anchor::kHead ? share : 1.0 - share) * to.bulge;
  return point;
}

Isometry3d ActionPath::StrokeAt(double time_s) const {
  Isometry3d all = Isometry3d::Identity();
  for (const Stroke& stroke : strokes_) {
    if (time_s <= stroke.begin_s || time_s >= stroke.end_s) continue;
    const double fade = MinimumJerk((time_s - stroke.begin_s) / stroke.period_s) *
                        MinimumJerk((stroke.end_s - time_s) / stroke.period_s);
    const double phase = 2.0 * std::numbers::pi * (time_s - stroke.begin_s) / stroke.period_s;
    const double swing = fade * std::sin(phase);
    Isometry3d one = Isometry3d::Identity();
    one.linear() = ExpSO3(swing * stroke.turn);
    one.translation() = stroke.pivot - one.linear() * stroke.pivot + swing * stroke.move +
                        fade * (std::cos(phase) - 1.0) * stroke.move_aside;
    all = all * one;
  }
  return all;
}

}  // namespace holdfast
