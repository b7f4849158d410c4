// SPDX-License-Identifier: MIT
#include "solver/synthesis/return_motion.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "generator/matching/body_frame.h"
#include "generator/matching/leg_placement.h"
#include "generator/scripted/minimum_jerk.h"
#include "geometry/body/skeleton.h"
#include "geometry/rotation.h"
#include "solver/synthesis/synthesis.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kSetsOut_m = 0.02;  // distance of the wrist from its first position
constexpr double kJoins_s = 0.7, kSettles_s = 0.4, kToRest_s = 1.2, kStandsAfter_s = 0.6;
constexpr int kRightArm[] = {kRightCollar, kRightShoulder, kRightElbow, kRightWrist};

// Applies `share` of the change from `from` to `to` to `frame`.
BodyFrame WithDifference(const BodyFrame& frame, const BodyFrame& from, const BodyFrame& to,
                         double share) {
  BodyFrame out = frame;
  out.pelvis += share * (to.pelvis - from.pelvis);
  for (int j = 0; j < kNumBodyJoints; ++j) {
    const Quaterniond difference = from.local[j].conjugate() * to.local[j];
    out.local[j] = frame.local[j] * Quaterniond::Identity().slerp(share, difference);
  }
  return out;
}

class Return {
 public:
  Return(const Eigen::Matrix3Xd& rest_joints, const Clip& clip)
      : rest_joints_(rest_joints), rate_(clip.frame_rate), frames_(BodyFrames(clip, rest_joints)) {
    for (const BodyFrame& frame : frames_) wrists_.push_back(Wrist(frame));
  }

  // Returns frames of the way back, ending at the first frame; empty if the wrist stayed.
  std::vector<BodyFrame> WayBack() const {
    const auto away = [&](std::size_t t) {
      return (wrists_[t].translation() - wrists_[0].translation()).norm();
    };
    std::size_t leaves = 0, far = 0;
    while (leaves < wrists_.size() && away(leaves) < kSetsOut_m) ++leaves;
    if (leaves == wrists_.size()) return {};
    for (std::size_t t = 0; t < wrists_.size(); ++t) far = away(t) > away(far) ? t : far;
    // The frame on the way there that is most similar to the last one.
    std::size_t join = leaves;
    for (std::size_t t = leaves; t <= far; ++t) {
      if (FromEnd(t) < FromEnd(join)) join = t;
    }
    const std::size_t until = leaves > Count(kSettles_s) ? leaves - Count(kSettles_s) : 0;
    const std::size_t count = join - until, settle = std::min(count, Count(2.0 * kSettles_s));
    std::vector<BodyFrame> back;
    for (std::size_t k = 1; k <= count; ++k) {
      const double left = 1.0 - MinimumJerk(Ratio(k, Count(kJoins_s)));
      BodyFrame frame = WithDifference(frames_[join - k], frames_[join], frames_.back(), left);
      const double settled =
          k + settle > count ? MinimumJerk(Ratio(k + settle - count, settle)) : 0.0;
      frame = WithDifference(frame, frames_[until], frames_.front(), settled);
      PlaceLegs(rest_joints_, FeetOf(Place(rest_joints_, frames_.front())), frame);
      back.push_back(frame);
    }
    return back;
  }

  // Moves the right arm from the first frame's pose to hanging, then stands.
  std::vector<BodyFrame> ToRest() const {
    const BodyFrame& first = frames_.front();
    const BodyFrame hanging = Mirror(first);  // its right arm is the mirrored left one
    std::vector<BodyFrame> rest(Count(kToRest_s) + Count(kStandsAfter_s), first);
    for (std::size_t k = 0; k < rest.size(); ++k) {
      const double share = MinimumJerk(Ratio(k + 1, Count(kToRest_s)));
      for (const int joint : kRightArm) {
        rest[k].local[joint] = first.local[joint].slerp(share, hanging.local[joint]);
      }
    }
    return rest;
  }

  Isometry3d Wrist(const BodyFrame& frame) const {
    return Place(rest_joints_, frame).WorldFromJoint(WristJoint(Side::kRight));
  }
  const std::vector<BodyFrame>& Frames() const { return frames_; }

 private:
  std::size_t Count(double seconds) const {
    return static_cast<std::size_t>(std::max(1L, std::lround(seconds * rate_)));
  }
  static double Ratio(std::size_t part, std::size_t whole) {
    return static_cast<double>(part) / static_cast<double>(whole);
  }
  double FromEnd(std::size_t t) const {
    constexpr double kMetersPerRadian = 0.15;
    return (wrists_[t].translation() - wrists_.back().translation()).norm() +
           kMetersPerRadian * AngleBetween(wrists_[t].linear(), wrists_.back().linear());
  }

  const Eigen::Matrix3Xd& rest_joints_;
  double rate_;
  std::vector<BodyFrame> frames_;
  std::vector<Isometry3d> wrists_;
};

}  // namespace

void AddReturn(const Eigen::Matrix3Xd& rest_joints, bool lets_go, Clip& clip) {
  const Return way(rest_joints, clip);
  const std::vector<BodyFrame> back = way.WayBack();
  if (back.empty()) return;
  const Isometry3d first = clip.object->Pose(0);
  const Isometry3d wrist_from_object =
      way.Wrist(way.Frames().back()).inverse() * clip.object->Pose(clip.NumFrames() - 1);
  std::vector<BodyFrame> rest;
  if (lets_go) rest = way.ToRest();
  std::vector<BodyFrame> all = way.Frames();
  all.insert(all.end(), back.begin(), back.end());
  all.insert(all.end(), rest.begin(), rest.end());

  const Eigen::Index before = clip.NumFrames();
  const Eigen::Index held = before + static_cast<Eigen::Index>(back.size());
  const auto count = static_cast<Eigen::Index>(all.size());
  clip.trans.conservativeResize(3, count);
  clip.object->trans.conservativeResize(3, count);
  clip.object->orient.conservativeResize(3, count);
  clip.pose.resize(all.size(), clip.pose.back());
  clip.holding_hand.resize(all.size(), clip.holding_hand.back());
  const JointPose at_ease = MirrorPose(clip.pose.front());  // right fingers as the left ones
  for (Eigen::Index t = before; t < count; ++t) {
    const std::size_t frame = static_cast<std::size_t>(t);
    clip.pose[frame] = clip.pose[frame - 1];  // unwrapped from the previous frame
    // The object ends exactly where it was: the grasp may have slipped slightly.
    clip.object->SetPose(t, t < held - 1 ? way.Wrist(all[frame]) * wrist_from_object : first);
    if (t < held) continue;
    clip.holding_hand[frame] = 0;
    const double opened = MinimumJerk(static_cast<double>(t - held + 1) / (0.5 * clip.frame_rate));
    const auto& fingers = clip.pose[static_cast<std::size_t>(held) - 1];
    clip.pose[frame].rightCols<15>() =
        (1.0 - opened) * fingers.rightCols<15>() + opened * at_ease.rightCols<15>();
  }
  SetBodyFrames(all, rest_joints, clip);
}

}  // namespace holdfast
