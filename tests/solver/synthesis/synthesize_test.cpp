// SPDX-License-Identifier: MIT
#include "solver/synthesis/synthesize.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "generator/imos/synthesis_network.h"
#include "geometry/body/body_model.h"
#include "geometry/error.h"
#include "geometry/import/load_clip.h"
#include "geometry/score/hand_object_score.h"
#include "tests/support/error_text.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

imos::Intent Intent(std::string_view action, std::string_view object) {
  return {imos::ActionId(action, "action"), imos::ObjectId(object, "object")};
}

TEST(Synthesize, MakesAMotionOfAHeldStartTheSameOnAnyThreads) {
  const ClipBody body{BodyModel::Default(), {}};
  const LoadedObject mug = LoadObject("mug");
  StandingHoldOptions holding;
  holding.hands = GraspHands::kLeft;
  const StandingHold hold = MakeStandingHold(body, mug, "drink", holding);
  ASSERT_EQ(hold.fault, "");
  EXPECT_TRUE(hold.start.mirrored);
  SynthesizeOptions options;
  options.samples = 2;
  const SynthesizedMotion made =
      Synthesize(hold.start, imos::DefaultNetwork(), Intent("drink", "mug"), options);
  ASSERT_THAT(made.samples, SizeIs(2));
  EXPECT_LE(made.samples[0].faults, made.samples[1].faults);
  EXPECT_EQ(made.first_hand, Side::kLeft);
  EXPECT_EQ(made.motion.action, "drink");
  EXPECT_EQ(made.motion.holding_hand.front(), kHoldsLeft);  // out of the mirror
  options.threads = 3;
  const SynthesizedMotion again =
      Synthesize(hold.start, imos::DefaultNetwork(), Intent("drink", "mug"), options);
  EXPECT_EQ(again.motion.trans, made.motion.trans);
  EXPECT_EQ(again.motion.object->trans, made.motion.object->trans);
}

TEST(Synthesize, EndsWhereItBeganAndStandsThere) {
  const ClipBody body{BodyModel::Default(), {}};
  SynthesizeOptions options;
  options.samples = 1;
  for (const bool in_hand : {false, true}) {
    StandingHoldOptions holding;
    holding.in_hand = in_hand;
    const StandingHold hold = MakeStandingHold(body, LoadObject("cube"), "lift", holding);
    ASSERT_EQ(hold.fault, "");
    const SynthesizedMotion made =
        Synthesize(hold.start, imos::DefaultNetwork(), Intent("lift", "cube"), options);
    const Clip& clip = made.motion;
    const int last = clip.NumFrames() - 1;
    EXPECT_EQ(clip.holding_hand[last], in_hand ? kHoldsRight : 0);
    EXPECT_LT((clip.object->trans.col(last) - clip.object->trans.col(0)).norm(),
              in_hand ? 0.06 : 1e-6);
    const Eigen::Matrix3Xd& rest = hold.start.actor->Measures().rest_joints;
    const auto wrist = WristPoses(clip, rest, Side::kRight);
    EXPECT_LT((wrist[last].translation() - wrist[last - 6].translation()).norm(), 0.02) << in_hand;
    const auto up = [&](int t) {
      BodyState state;
      ForwardJoints(rest, clip.pose[t], clip.trans.col(t), state);
      return state.WorldFromJoint(kHead).linear()(2, 2);
    };
    EXPECT_GT(up(last), -0.5) << "looks up";
  }
}

TEST(MakeStandingHold, AnotherSeedStandsOtherwiseWithTheVesselUpright) {
  const ClipBody body{BodyModel::Default(), {}};
  std::vector<Eigen::Matrix3Xd> stands;
  for (const std::uint64_t seed : {1, 2, 3}) {
    StandingHoldOptions holding;
    holding.seed = seed;
    holding.in_hand = false;
    const StandingHold hold = MakeStandingHold(body, LoadObject("mug"), "pass", holding);
    ASSERT_EQ(hold.fault, "");
    const Clip& clip = hold.start.clip;
    BodyState state;
    ForwardJoints(hold.start.actor->Measures().rest_joints, clip.pose[0], clip.trans.col(0), state);
    stands.push_back(state.joints.leftCols(22).colwise() - state.joints.col(0));
    EXPECT_GT(clip.object->Pose(0).linear()(2, 2), 0.98) << seed;
    for (const int foot : {7, 8}) EXPECT_NEAR(state.joints(2, foot), state.joints(2, 7), 0.01);
  }
  for (const auto& [a, b] : {std::pair(0, 1), {0, 2}, {1, 2}}) {
    EXPECT_GT((stands[a] - stands[b]).colwise().norm().mean(), 0.01) << a << " " << b;
  }
}

TEST(Synthesize, BothHandsKeepTheObjectBetweenThem) {
  const ClipBody body{BodyModel::Default(), {}};
  StandingHoldOptions holding;
  holding.hands = GraspHands::kBoth;
  const StandingHold hold = MakeStandingHold(body, LoadObject("bowl"), "lift", holding);
  ASSERT_EQ(hold.fault, "");
  EXPECT_TRUE(hold.start.both);
  SynthesizeOptions options;
  options.samples = 4;
  const SynthesizedMotion made =
      Synthesize(hold.start, imos::DefaultNetwork(), Intent("lift", "bowl"), options);
  const Clip& clip = made.motion;
  EXPECT_THAT(clip.holding_hand, ::testing::Each(kHoldsRight | kHoldsLeft));
  const Eigen::Matrix3Xd& rest = hold.start.actor->Measures().rest_joints;
  const auto object_from = [&](Side side, int t) -> Eigen::Isometry3d {
    return clip.object->Pose(t).inverse() * WristPoses(clip, rest, side)[t];
  };
  double moved = 0.0;
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const Eigen::Isometry3d first = object_from(side, 0);
    for (int t = 0; t < clip.NumFrames(); t += 5) {
      EXPECT_LT((object_from(side, t).translation() - first.translation()).norm(), 0.02)
          << SideName(side) << " " << t;
      moved = std::max(moved, (clip.object->trans.col(t) - clip.object->trans.col(0)).norm());
    }
  }
  EXPECT_GT(moved, 0.05);
  EXPECT_THAT(testing::ErrorText([&] {
                Synthesize(hold.start, imos::DefaultNetwork(), Intent("offhand", "bowl"), options);
              }),
              HasSubstr("both hands hold"));
}

TEST(Synthesize, ThePersonDoesNotFreezeAndTheRimComesToTheLips) {
  const ClipBody body{BodyModel::Default(), {}};
  const StandingHold hold = MakeStandingHold(body, LoadObject("mug"), "drink", {});
  ASSERT_EQ(hold.fault, "");
  SynthesizeOptions options;
  options.samples = 1;
  const SynthesizedMotion made =
      Synthesize(hold.start, imos::DefaultNetwork(), Intent("drink", "mug"), options);
  const Clip& clip = made.motion;
  const auto face = NearestToFace(hold.start, "drink", clip);
  ASSERT_TRUE(face);
  EXPECT_LT(face->distance_m, 0.01);
  EXPECT_FALSE(NearestToFace(hold.start, "pour", clip));

  // Networks are given four key frames of somebody who stands still: 0.9 s.
  double least_still = 1e9, slid = 0.0;
  std::vector<Eigen::Matrix3Xd> joints;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    BodyState state;
    ForwardJoints(hold.start.actor->Measures().rest_joints, clip.pose[t], clip.trans.col(t), state);
    joints.push_back(state.joints);
    slid = std::max(slid, (joints[t].col(7) - joints[0].col(7)).norm());
  }
  for (int t = 10; t + 10 < clip.NumFrames(); ++t) {
    const Eigen::Matrix3Xd moved = joints[t + 10] - joints[t];
    least_still = std::min(least_still, moved.leftCols(22).colwise().norm().maxCoeff());
  }
  EXPECT_GT(least_still, 5e-4) << "meters that the liveliest joint moves in a third of a second";
  EXPECT_LT(slid, 2e-3);

  // The hand keeps its grasp: the object goes along with the wrist.
  const Clip start = hold.start.clip;
  const auto in_wrist = [&](const Clip& of, int t) -> Eigen::Isometry3d {
    BodyState state;
    ForwardJoints(hold.start.actor->Measures().rest_joints, of.pose[t], of.trans.col(t), state);
    return state.WorldFromJoint(WristJoint(Side::kRight)).inverse() * of.object->Pose(t);
  };
  const Eigen::Isometry3d before = in_wrist(start, start.NumFrames() - 1);
  const Eigen::Isometry3d at_face = in_wrist(clip, face->frame);
  EXPECT_LT((before.translation() - at_face.translation()).norm(), 0.02);
}

TEST(Synthesize, ABrushComesFromTheSideAndTheElbowHangs) {
  const ClipBody body{BodyModel::Default(), {}};
  const StandingHold hold = MakeStandingHold(body, LoadObject("toothbrush"), "brush", {});
  ASSERT_EQ(hold.fault, "");
  SynthesizeOptions options;
  options.samples = 8;
  const Clip clip =
      Synthesize(hold.start, imos::DefaultNetwork(), Intent("brush", "toothbrush"), options).motion;
  const auto face = NearestToFace(hold.start, "brush", clip);
  ASSERT_TRUE(face);
  EXPECT_LT(face->distance_m, 0.015);
  BodyState state;
  ForwardJoints(hold.start.actor->Measures().rest_joints, clip.pose[face->frame],
                clip.trans.col(face->frame), state);
  const Eigen::Vector3d points = state.WorldFromJoint(kHead).linear().transpose() *
                                 clip.object->Pose(face->frame).linear() *
                                 hold.start.prop->marks.forward;
  EXPECT_GT(points.x(), 0.75) << "to the left, from the hand's side";
  EXPECT_LT(state.joints(2, kRightElbow), state.joints(2, kRightShoulder) + 0.02);
}

TEST(HoldingStart, OfAClipNeedsTheObjectInAHand) {
  const LoadedClip motion = LoadClip("demo_drink");
  const auto refused = [&](const Clip& clip, std::optional<int> frame) {
    return testing::ErrorText([&] { StartInClip(clip, motion.body, LoadObject("mug"), frame); });
  };
  EXPECT_THAT(refused(motion.clip, 9999), HasSubstr("but no frame 9999"));
  EXPECT_THAT(refused(motion.clip, 3), HasSubstr("has no object track"));
}

}  // namespace
}  // namespace holdfast
