// SPDX-License-Identifier: MIT
#include "solver/synthesis/motion_passes.h"

#include <gtest/gtest.h>

#include "generator/scripted/reach_motion.h"

namespace holdfast {
namespace {

// The right hand sets out after `still_s`.
Clip Waits(const BodyMeasures& body, double still_s) {
  ReachKey start, waits, up;
  start.wrist = {-0.25, -0.25, 1.0};
  waits = start;
  waits.time_s = still_s;
  up.time_s = still_s + 0.8;
  up.wrist = {-0.15, -0.30, 1.4};
  Clip clip = MakeReachMotion(body, {start, waits, up}, {.liveliness = 0.0});
  clip.holding_hand.assign(clip.pose.size(), kHoldsRight);
  clip.object.emplace();
  clip.object->trans = clip.trans;
  clip.object->orient = Eigen::Matrix3Xd::Zero(3, clip.NumFrames());
  return clip;
}

TEST(StillStart, OfStandingStillAThirdOfASecondStays) {
  const BodyMeasures body = MeasureBody(*BodyModel::Default(), {});
  const Clip before = Waits(body, 1.2);
  Clip after = before;
  const int left_out = TrimIdle(body.rest_joints, after);
  // Until then, and a little of the way.
  EXPECT_GE(left_out, 27);
  EXPECT_LE(left_out, 37);
  ASSERT_EQ(after.NumFrames(), before.NumFrames() - left_out);
  EXPECT_EQ(after.pose.front(), before.pose.front());
  for (int t = 10; t < after.NumFrames(); ++t) {
    EXPECT_EQ(after.pose[t], before.pose[t + left_out]);
    EXPECT_EQ(after.object->trans.col(t), before.object->trans.col(t + left_out));
  }
  EXPECT_EQ(after.trans.cols(), after.NumFrames());
  EXPECT_EQ(after.object->orient.cols(), after.NumFrames());
  EXPECT_EQ(static_cast<int>(after.holding_hand.size()), after.NumFrames());
}

TEST(StillStart, WhoSetsOutAtOnceAndWhoNeverDoesKeepAll) {
  const BodyMeasures body = MeasureBody(*BodyModel::Default(), {});
  Clip at_once = Waits(body, 0.05);
  Clip never = Slice(Waits(body, 2.0), 0, 50);
  EXPECT_EQ(TrimIdle(body.rest_joints, at_once), 0);
  EXPECT_EQ(TrimIdle(body.rest_joints, never), 0);
  EXPECT_EQ(never.NumFrames(), 50);
}

}  // namespace
}  // namespace holdfast
