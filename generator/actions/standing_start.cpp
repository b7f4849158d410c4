// SPDX-License-Identifier: MIT
#include "generator/actions/standing_start.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "generator/body/limb_ik.h"
#include "geometry/body/skeleton.h"

namespace holdfast {
namespace {

using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;
constexpr int kHip = 1, kKnee = 4, kAnkle = 7;  // left; the right is next
constexpr int kLeastFrames = 24, kMostFrames = 150;
constexpr double kStill_m = 0.02;  // that an ankle or, twice that, the pelvis wanders
constexpr double kIdle_m = 0.10;   // that a hand wanders, against the pelvis

bool Stands(const Eigen::Matrix3Xd& rest_joints, const BodyFrame& frame) {
  const BodyPlacement at = Place(rest_joints, frame);
  if (at.rotation[0](2, 1) < 0.96 || at.rotation[kSpine3](2, 1) < 0.93) return false;
  if (at.rotation[kHead](2, 1) < 0.93) return false;
  // The face looks where the body does.
  const Vector3d forward = at.rotation[0].col(2);
  if (at.rotation[kHead].col(2).head<2>().dot(forward.head<2>()) < 0.85) return false;
  for (const int side : {0, 1}) {
    const Vector3d hip = at.joints.col(kHip + side), ankle = at.joints.col(kAnkle + side);
    const double longest = (rest_joints.col(kHip + side) - rest_joints.col(kKnee + side)).norm() +
                           (rest_joints.col(kKnee + side) - rest_joints.col(kAnkle + side)).norm();
    if ((hip - ankle).norm() < 0.945 * longest || ankle.z() > 0.16) return false;
    const Vector3d wrist = at.joints.col(20 + side), shoulder = at.joints.col(16 + side);
    const Vector3d from_pelvis = wrist - at.joints.col(0);
    if (wrist.z() > at.joints(2, 0) + 0.22 || from_pelvis.head<2>().norm() > 0.48) return false;
    if (from_pelvis.dot(forward) < -0.12 || shoulder.z() < wrist.z()) return false;
  }
  const Vector3d apart = at.joints.col(kAnkle) - at.joints.col(kAnkle + 1);
  return apart.head<2>().norm() > 0.08 && apart.head<2>().norm() < 0.50 &&
         std::abs(apart.z()) < 0.03;
}

// How long, from `begin`, feet and pelvis stay where they are.
int StillUntil(const Eigen::Matrix3Xd& rest_joints, std::span<const BodyFrame> frames, int begin) {
  const BodyPlacement first = Place(rest_joints, frames[static_cast<std::size_t>(begin)]);
  int t = begin;
  for (; t < std::min<int>(static_cast<int>(frames.size()), begin + kMostFrames); ++t) {
    const BodyFrame& frame = frames[static_cast<std::size_t>(t)];
    if (!Stands(rest_joints, frame)) break;
    const BodyPlacement at = Place(rest_joints, frame);
    const auto wandered = [&](int joint) {
      return (at.joints.col(joint) - first.joints.col(joint)).norm();
    };
    if (wandered(kAnkle) > kStill_m || wandered(kAnkle + 1) > kStill_m ||
        wandered(0) > 2.0 * kStill_m) {
      break;
    }
    // Whoever gestures is not idle.
    const Vector3d along = at.joints.col(0) - first.joints.col(0);
    const auto gestured = [&](int wrist) {
      return (at.joints.col(wrist) - first.joints.col(wrist) - along).norm();
    };
    if (gestured(20) > kIdle_m || gestured(21) > kIdle_m) break;
  }
  return t;
}

}  // namespace

std::vector<StandingStart> FindStandingStarts(const Eigen::Matrix3Xd& rest_joints,
                                              std::span<const BodyFrame> frames) {
  std::vector<StandingStart> starts;
  const int count = static_cast<int>(frames.size());
  for (int begin = 0; begin + kLeastFrames <= count;) {
    const int end = StillUntil(rest_joints, frames, begin);
    if (end - begin < kLeastFrames) {
      begin = std::max(end, begin + 3);
      continue;
    }
    StandingStart start;
    start.source_frame = begin;
    const PlanarMove home = AlignHeading(frames[static_cast<std::size_t>(begin)], BodyFrame());
    for (int t = begin; t < end; ++t) {
      start.frames.push_back(home * frames[static_cast<std::size_t>(t)]);
    }
    starts.push_back(std::move(start));
    begin = end;
  }
  return starts;
}

StandingStart OwnStanding(const BodyMeasures& body, std::uint64_t seed) {
  const Limb arm = Arm(Side::kRight);
  const Vector3d shoulder = body.rest_joints.col(arm.root) - body.rest_joints.col(0);
  const double height = body.rest_joints(1, arm.root) - body.sole_y;
  const double reach = MaxReach(body.rest_joints, arm);
  ReachKey hang;
  hang.wrist = Vector3d(shoulder.x() - 0.08, -0.06, height - 0.97 * reach);
  hang.hand = HandOrientation(Side::kRight, -Vector3d::UnitZ(), -Vector3d::UnitY());
  hang.gaze = 0.0;
  ScriptedReachOptions options;
  options.duration_s = kMostFrames / 30.0;
  options.seed = seed;
  StandingStart start;
  start.source = "own";
  start.frames = BodyFrames(MakeReachMotion(body, {hang}, options), body.rest_joints);
  return start;
}

std::vector<BodyFrame> IdleMotion(const BodyMeasures& body, const StandingStart& start, int count) {
  const int last = static_cast<int>(start.frames.size()) - 1;
  const BodyPlacement first = Place(body.rest_joints, start.frames.front());
  const double ankle = std::min(body.rest_joints(1, kAnkle), body.rest_joints(1, kAnkle + 1));
  const double raise =
      ankle - body.sole_y - std::min(first.joints(2, kAnkle), first.joints(2, kAnkle + 1));
  std::vector<BodyFrame> frames;
  for (int t = 0; t < count; ++t) {
    const double place = last == 0 ? 0.0 : 0.5 * last * (1.0 - std::cos(kPi * t / last));
    const int before = std::min(static_cast<int>(place), std::max(0, last - 1));
    BodyFrame frame = Interpolate(
        start.frames[static_cast<std::size_t>(before)],
        start.frames[static_cast<std::size_t>(std::min(before + 1, last))], place - before);
    frame.pelvis.z() += raise;
    frames.push_back(frame);
  }
  return frames;
}

}  // namespace holdfast
