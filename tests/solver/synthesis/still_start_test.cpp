// SPDX-License-Identifier: MIT
#include "solver/synthesis/still_start.h"

#include <gtest/gtest.h>

#include "generator/scripted/reach_motion.h"

namespace holdfast {
namespace {

// Key frames five a second; the right hand sets out after `still_s`.
Clip Keys(const BodyMeasures& body, double still_s) {
  ReachKey start, waits, up;
  start.wrist = {-0.25, -0.25, 1.0};
  waits = start;
  waits.time_s = still_s;
  up.time_s = still_s + 0.8;
  up.wrist = {-0.15, -0.30, 1.4};
  ScriptedReachOptions options;
  options.liveliness = 0.0;
  options.duration_s = 3.0;
  Clip whole = MakeReachMotion(body, {start, waits, up}, options);
  Clip keys = Slice(whole, 0, 1);
  keys.frame_rate = 5.0;
  keys.pose.clear();
  keys.trans.resize(3, 15);
  for (int k = 0; k < 15; ++k) {
    keys.pose.push_back(whole.pose[static_cast<std::size_t>(6 * k)]);
    keys.trans.col(k) = whole.trans.col(6 * k);
  }
  keys.holding_hand.assign(15, kHoldsRight);
  keys.object.emplace();
  keys.object->trans = keys.trans;
  keys.object->orient = Eigen::Matrix3Xd::Zero(3, 15);
  return keys;
}

TEST(StillStart, KeyFramesInWhichNothingHappensAreLeftOut) {
  const BodyMeasures body = MeasureBody(*BodyModel::Default(), {});
  const Clip before = Keys(body, 1.2);
  Clip after = before;
  const int left_out = LeaveOutStill(body.rest_joints, after);
  EXPECT_GE(left_out, 4);
  EXPECT_LE(left_out, 6);
  ASSERT_EQ(after.NumFrames(), 15 - left_out);
  EXPECT_EQ(after.pose.front(), before.pose.front());
  for (int k = 1; k < after.NumFrames(); ++k) {
    EXPECT_EQ(after.pose[static_cast<std::size_t>(k)],
              before.pose[static_cast<std::size_t>(k + left_out)]);
    EXPECT_EQ(after.object->trans.col(k), before.object->trans.col(k + left_out));
  }
  EXPECT_EQ(after.trans.cols(), after.NumFrames());
  EXPECT_EQ(after.object->orient.cols(), after.NumFrames());
  EXPECT_EQ(static_cast<int>(after.holding_hand.size()), after.NumFrames());
}

TEST(StillStart, WhoSetsOutAtOnceAndWhoNeverDoesKeepAll) {
  const BodyMeasures body = MeasureBody(*BodyModel::Default(), {});
  Clip at_once = Keys(body, 0.05), never = Keys(body, 2.9);
  EXPECT_EQ(LeaveOutStill(body.rest_joints, at_once), 0);
  EXPECT_EQ(LeaveOutStill(body.rest_joints, never), 0);
  EXPECT_EQ(never.NumFrames(), 15);
}

}  // namespace
}  // namespace holdfast
