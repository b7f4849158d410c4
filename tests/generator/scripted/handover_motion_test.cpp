// SPDX-License-Identifier: MIT
#include "generator/scripted/handover_motion.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/rotation.h"
#include "tests/generator/test_body.h"

namespace holdfast {
namespace {

const Eigen::Matrix3Xd& Apple() {
  static const Eigen::Matrix3Xd vertices =
      ReadMesh(HOLDFAST_MESHES_DIR "/objects/apple.ply").vertices;
  return vertices;
}

HandoverMotion Make(std::uint64_t seed, HandoverOptions options = {}) {
  options.seed = seed;
  return MakeHandoverMotion(DefaultMeasures(), PalmGrasps(DefaultMeasures(), Apple(), seed),
                            options);
}

// Where the object is in a wrist's frame.
Eigen::Isometry3d WristFromObject(const Clip& clip, int frame, Side side) {
  BodyState state;
  ForwardJoints(DefaultMeasures().rest_joints, clip.pose[frame], clip.trans.col(frame), state);
  Eigen::Isometry3d wrist = Eigen::Isometry3d::Identity(), object = wrist;
  wrist.linear() = state.world_rotation[WristJoint(side)];
  wrist.translation() = state.joints.col(WristJoint(side));
  object.linear() = ExpSO3(clip.object->orient.col(frame));
  object.translation() = clip.object->trans.col(frame);
  return wrist.inverse() * object;
}

class Handover : public ::testing::TestWithParam<int> {};

TEST_P(Handover, CarriesTheObjectRigidlyInEveryHandThatHolds) {
  const HandoverMotion motion = Make(GetParam());
  const HandoverGrasps grasps = PalmGrasps(DefaultMeasures(), Apple(), GetParam());
  ASSERT_EQ(motion.clip.holding_hand.size(), motion.clip.pose.size());
  for (int t = 0; t < motion.clip.NumFrames(); ++t) {
    for (const Side side : {Side::kRight, Side::kLeft}) {
      const int bit = side == Side::kRight ? kHoldsRight : kHoldsLeft;
      if ((motion.clip.holding_hand[t] & bit) == 0) continue;
      const Eigen::Isometry3d seen = WristFromObject(motion.clip, t, side);
      const Eigen::Isometry3d& grasp = grasps.Of(side).wrist_from_object;
      EXPECT_LT((seen.translation() - grasp.translation()).norm(), 1e-6) << "frame " << t;
      EXPECT_LT(AngleBetween(seen.linear(), grasp.linear()), 1e-6) << "frame " << t;
    }
  }
}

TEST_P(Handover, SwitchesInTheMiddleOfTheTimeThatBothHold) {
  const HandoverMotion motion = Make(GetParam());
  const std::vector<std::uint8_t>& hands = motion.clip.holding_hand;
  ASSERT_GE(motion.switch_frames.size(), 1u);
  ASSERT_LE(motion.switch_frames.size(), 3u);
  int holder = motion.first_hand == Side::kRight ? kHoldsRight : kHoldsLeft;
  EXPECT_EQ(hands.front(), holder);
  for (const int frame : motion.switch_frames) {
    EXPECT_EQ(hands[frame], kHoldsRight | kHoldsLeft);
    int begin = frame, end = frame;
    while (hands[begin - 1] == 3) --begin;
    while (hands[end + 1] == 3) ++end;
    EXPECT_NEAR(0.5 * (begin + end), frame, 1.0);
    EXPECT_GE(end - begin + 2, 3);  // 0.1 s at 30 Hz
    EXPECT_LE(end - begin, 15);     // 0.5 s
    EXPECT_EQ(hands[begin - 1], holder);
    holder = 3 - holder;
    EXPECT_EQ(hands[end + 1], holder);
  }
  EXPECT_EQ(hands.back(), holder);
}

TEST_P(Handover, MovesWithoutJumps) {
  const HandoverMotion motion = Make(GetParam());
  for (int t = 1; t < motion.clip.NumFrames(); ++t) {
    EXPECT_LT((motion.clip.object->trans.col(t) - motion.clip.object->trans.col(t - 1)).norm(),
              0.10);
    EXPECT_LT((motion.clip.pose[t] - motion.clip.pose[t - 1]).cwiseAbs().maxCoeff(), 0.6);
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, Handover, ::testing::Range(1, 7));

TEST(HandoverMotion, IsTheSameForTheSameSeedAndAnotherForAnother) {
  const HandoverMotion one = Make(5), again = Make(5), other = Make(6);
  EXPECT_EQ(one.switch_frames, again.switch_frames);
  ASSERT_EQ(one.clip.NumFrames(), again.clip.NumFrames());
  EXPECT_EQ(one.clip.pose.back(), again.clip.pose.back());
  EXPECT_EQ(one.clip.object->trans, again.clip.object->trans);
  EXPECT_NE(one.switch_frames, other.switch_frames);
}

TEST(HandoverMotion, DoesAsItIsTold) {
  HandoverOptions options;
  options.switches = 3;
  options.first_hand = Side::kLeft;
  options.frame_rate = 60.0;
  options.min_dwell_s = options.max_dwell_s = 0.25;
  const HandoverMotion motion = Make(9, options);
  EXPECT_EQ(motion.switch_frames.size(), 3u);
  EXPECT_EQ(motion.first_hand, Side::kLeft);
  EXPECT_EQ(motion.clip.frame_rate, 60.0);
  const auto both = std::count(motion.clip.holding_hand.begin(), motion.clip.holding_hand.end(), 3);
  EXPECT_NEAR(static_cast<double>(both), 3 * 15.0, 3.0);
}

TEST(HandoverMotion, RefusesWhatItCannotDo) {
  HandoverOptions options;
  options.switches = 21;
  EXPECT_THROW(Make(1, options), Error);
  options = {};
  options.max_dwell_s = 0.05;
  EXPECT_THROW(Make(1, options), Error);
  options = {};
  options.frame_rate = 0.0;
  EXPECT_THROW(Make(1, options), Error);
  EXPECT_THROW(PalmGrasps(DefaultMeasures(), Eigen::Matrix3Xd(3, 0), 1), Error);
}

TEST(MakeHandoverMotion, IsTheSameWhereverTheBodyRests) {
  const Eigen::Vector3d shift(0.2, -0.4, 0.1);
  const BodyMeasures moved = MeasuresAt(shift);
  HandoverOptions options;
  options.seed = 3;
  const Clip here = Make(3).clip;
  const Clip there = MakeHandoverMotion(moved, PalmGrasps(moved, Apple(), 3), options).clip;
  ASSERT_EQ(here.NumFrames(), there.NumFrames());
  EXPECT_LT((there.trans.colwise() + shift - here.trans).cwiseAbs().maxCoeff(), 1e-5);
  EXPECT_LT((there.object->trans - here.object->trans).cwiseAbs().maxCoeff(), 1e-5);
}

TEST(AddNoise, HasTheSizeAskedFor) {
  const HandoverMotion motion = Make(2);
  Clip noisy = motion.clip;
  AddNoise(noisy, {0.005, 0.05, 0.02}, 7);
  const int frames = noisy.NumFrames();
  double trans = 0.0, orient = 0.0, elbow = 0.0;
  for (int t = 0; t < frames; ++t) {
    trans += (noisy.object->trans.col(t) - motion.clip.object->trans.col(t)).squaredNorm();
    orient += std::pow(AngleBetween(ExpSO3(noisy.object->orient.col(t)),
                                    ExpSO3(motion.clip.object->orient.col(t))),
                       2);
    elbow += std::pow(
        AngleBetween(ExpSO3(noisy.pose[t].col(19)), ExpSO3(motion.clip.pose[t].col(19))), 2);
  }
  // Three axes each; a few hundred draws are within ten percent.
  EXPECT_NEAR(std::sqrt(trans / (3.0 * frames)), 0.005, 0.0005);
  EXPECT_NEAR(std::sqrt(orient / (3.0 * frames)), 0.05, 0.005);
  EXPECT_NEAR(std::sqrt(elbow / (3.0 * frames)), 0.02, 0.002);
  Clip same = motion.clip;
  AddNoise(same, {}, 7);
  EXPECT_EQ(same.object->trans, motion.clip.object->trans);
  EXPECT_EQ(same.pose.back(), motion.clip.pose.back());
}

}  // namespace
}  // namespace holdfast
