// SPDX-License-Identifier: MIT
#include "solver/synthesis/motion_passes.h"

#include <gtest/gtest.h>

#include "generator/scripted/reach_motion.h"
#include "generator/walk_statistics/hand_way.h"

namespace holdfast {
namespace {

// The right hand goes up in two movements, is at rest for a moment between them, and stays there.
Clip InTwo(const BodyMeasures& body) {
  ReachKey start, halts, up, stays;
  start.wrist = {-0.25, -0.25, 1.0};
  halts.time_s = 0.5;
  halts.wrist = {-0.22, -0.28, 1.2};
  up.time_s = 1.2;
  up.wrist = {-0.15, -0.30, 1.4};
  stays = up;
  stays.time_s = 2.4;
  Clip clip = MakeReachMotion(body, {start, halts, up, stays}, {.liveliness = 0.0});
  clip.holding_hand.assign(clip.pose.size(), kHoldsRight);
  clip.object.emplace();
  clip.object->trans = clip.object->orient = Eigen::Matrix3Xd::Zero(3, clip.NumFrames());
  return clip;
}

Eigen::Matrix3Xd PathOf(const BodyMeasures& body, const Clip& clip) {
  const std::vector<BodyFrame> frames = BodyFrames(clip, body.rest_joints);
  return HandPath(frames, Place(body.rest_joints, frames), Side::kRight);
}

TEST(HandPace, TwoMovementsBecomeOneOnTheSameWayInTheSameTime) {
  const BodyMeasures body = MeasureBody(*BodyModel::Default(), {});
  const Clip before = InTwo(body);
  Clip after = before;
  RetimeHand(body.rest_joints, after);
  ASSERT_EQ(after.NumFrames(), before.NumFrames());
  const Eigen::Matrix3Xd was = PathOf(body, before), is = PathOf(body, after);
  const HandWay way_was = MeasureHandWay(was, before.frame_rate, 20);
  const HandWay way = MeasureHandWay(is, after.frame_rate, 20);
  // Between the first quarter and the last of the time.
  const auto slowest = [](const HandWay& of) { return of.profile.segment(5, 8).minCoeff(); };
  EXPECT_LT(slowest(way_was), 0.1);
  EXPECT_GT(slowest(way), 0.4);
  EXPECT_GT(way.time_to_peak_ratio, 0.2);
  EXPECT_LT(way.time_to_peak_ratio, 0.55);
  // Before and after the way nothing changes, and on it the hand is where it was once.
  EXPECT_EQ(after.pose.front(), before.pose.front());
  EXPECT_EQ(after.pose.back(), before.pose.back());
  for (int t = 0; t < after.NumFrames(); ++t) {
    EXPECT_LT((was.colwise() - is.col(t)).colwise().norm().minCoeff(), 0.03) << t;
  }
}

TEST(HandPace, AHandThatStaysIsLeftAsItIs) {
  const BodyMeasures body = MeasureBody(*BodyModel::Default(), {});
  Clip still = Slice(InTwo(body), 45, 60);
  const Clip before = still;
  RetimeHand(body.rest_joints, still);
  EXPECT_EQ(still.pose, before.pose);
  Clip one = Slice(before, 0, 1);
  RetimeHand(body.rest_joints, one);
  EXPECT_EQ(one.NumFrames(), 1);
}

}  // namespace
}  // namespace holdfast
