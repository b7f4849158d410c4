// SPDX-License-Identifier: MIT
#include "solver/handover/hand_meeting.h"

#include <algorithm>
#include <cmath>

#include "generator/scripted/minimum_jerk.h"
#include "geometry/rotation.h"
#include "solver/terms/hand/object_data.h"
#include "solver/unknowns/sparse_solve.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;

constexpr double kEase_s = 1.0, kLeastEase_s = 0.3;

Isometry3d WristAt(const HandModel& hand, const Clip& clip, int t) {
  return WristIn(hand, clip.pose[t], clip.trans.col(t));
}

WristOffset OffsetBetween(const Isometry3d& from, const Isometry3d& to) {
  const Isometry3d offset = from.inverse() * to;
  return {Eigen::Quaterniond(offset.linear()).normalized(), offset.translation()};
}

// From 0 at `from` over 1 in [begin, end) to 0 at `to`.
double ShareAt(int t, int from, int begin, int end, int to) {
  if (t < begin) return MinimumJerk(static_cast<double>(t - from) / (begin - from));
  return t < end ? 1.0 : MinimumJerk(static_cast<double>(to - t) / (to - end + 1));
}

}  // namespace

HandMeeting ShareTheWay(const Isometry3d& giver, const Isometry3d& receiver,
                        const Isometry3d& giver_from_receiver) {
  ObjectPose met(giver);
  double* const q = met.orientation.coeffs().data();
  ceres::Problem problem;
  problem.AddParameterBlock(q, 4, new RotationManifold);
  problem.AddResidualBlock(new ObjectData(ObjectPose(giver), 1.0), nullptr, q,
                           met.translation.data());
  problem.AddResidualBlock(
      new ObjectData(ObjectPose(receiver), 1.0, ObjectPose(giver_from_receiver)), nullptr, q,
      met.translation.data());
  SolveQuietly(SparseOptions(50, 1e-16), problem);
  return {OffsetBetween(giver, met.Transform()),
          OffsetBetween(receiver, met.Transform() * giver_from_receiver)};
}

void LetHandsMeet(const HandModel& right, const HandModel& left,
                  std::span<const HandSwitch> switches, std::span<const Handover> handovers,
                  Clip& clip) {
  const auto frames = [&](double seconds) {
    return std::max(1, static_cast<int>(std::lround(seconds * clip.frame_rate)));
  };
  int last_end = 0;
  for (const HandSwitch& change : switches) {
    const auto handover = std::ranges::find_if(handovers, [&](const Handover& one) {
      return one.to == change.to && one.frame == change.both_begin;
    });
    const int from = std::max(last_end, change.both_begin - frames(kEase_s));
    const int end = std::max(change.both_begin + 1, change.both_end);
    last_end = end;
    if (handover == handovers.end() || change.both_begin - from < frames(kLeastEase_s)) continue;
    const HandModel& giver = change.from == Side::kRight ? right : left;
    const HandModel& receiver = change.to == Side::kRight ? right : left;
    const HandMeeting meeting =
        ShareTheWay(WristAt(giver, clip, change.both_begin),
                    WristAt(receiver, clip, change.both_begin), handover->giver_from_receiver);
    const int to = end - 1 + frames(kEase_s);
    for (int t = from + 1; t < std::min(to, clip.NumFrames()); ++t) {
      const double share = ShareAt(t, from, change.both_begin, end, to);
      MoveHand(giver, meeting.giver.Scaled(share), clip.trans.col(t), clip.pose[t]);
      MoveHand(receiver, meeting.receiver.Scaled(share), clip.trans.col(t), clip.pose[t]);
    }
  }
}

WristChange LargestChange(const HandModel& hand, const Clip& from, const Clip& to, int begin,
                          int end) {
  WristChange most;
  for (int t = begin; t < std::min({end, from.NumFrames(), to.NumFrames()}); ++t) {
    const Isometry3d was = WristAt(hand, from, t), is = WristAt(hand, to, t);
    most.moved_m = std::max(most.moved_m, (is.translation() - was.translation()).norm());
    most.turned_rad = std::max(most.turned_rad, AngleBetween(is.linear(), was.linear()));
  }
  return most;
}

}  // namespace holdfast
