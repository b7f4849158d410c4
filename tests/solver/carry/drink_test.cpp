// SPDX-License-Identifier: MIT
#include "solver/carry/drink.h"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "generator/body/limb_ik.h"
#include "generator/body/pose_builder.h"
#include "generator/scripted/minimum_jerk.h"
#include "geometry/error.h"
#include "geometry/import/load_clip.h"
#include "geometry/rotation.h"
#include "solver/carry/carry.h"
#include "tests/support/error_text.h"

namespace holdfast {
namespace {

constexpr int kLift = 40, kDrink = 70, kPutDown = 100, kFrames = 140;

// Somebody who stands still but for the right arm: hand beside the body, to a table, to the mouth
// with the forearm turned so that what stood leans towards the face, and back.
struct DrinkTest : ::testing::Test {
  std::shared_ptr<const BodyModel> model = BodyModel::Default();
  BodySurface surface{model};
  FaceMarks face = FindFaceMarks(surface);
  Clip clip = Drinks();

  Clip Drinks() const {
    Clip made;
    made.frame_rate = 30.0;
    made.body_model = model->Name();
    made.trans.setZero(3, kFrames);
    JointPose pose = JointPose::Zero();
    pose.col(0) = Eigen::Vector3d::UnitX() * 90.0 * kDegree;
    pose(2, kRightShoulder) = 70.0 * kDegree;
    pose(2, kLeftShoulder) = -75.0 * kDegree;
    pose.col(kRightElbow) = 80.0 * kDegree * Arm(Side::kRight).hinge;
    BodyState state;
    ForwardJoints(surface.RestJoints(), pose, Eigen::Vector3d::Zero(), state);
    const Eigen::Vector3d mouth = state.WorldFromJoint(kHead) * face.mouth;
    // Facing -y; the thumb up, fingers to the left.
    const Eigen::Matrix3d upright =
        HandOrientation(Side::kRight, Eigen::Vector3d(0.6, -0.8, 0.0), Eigen::Vector3d::UnitZ());
    const Eigen::Matrix3d tilted = ExpSO3(Eigen::Vector3d::UnitX() * -50.0 * kDegree) * upright;
    const Eigen::Vector3d table = mouth + Eigen::Vector3d(-0.18, -0.28, -0.36);
    const Eigen::Vector3d rest = table + Eigen::Vector3d(-0.06, 0.1, 0.0);
    const Eigen::Vector3d drink = mouth + Eigen::Vector3d(-0.10, -0.09, -0.02);
    for (int t = 0; t < kFrames; ++t) {
      const int k = t <= 70 ? t : 140 - t;
      const double reach = MinimumJerk((k - 10) / 25.0), raise = MinimumJerk((k - 42) / 26.0);
      const Eigen::Vector3d at = rest + reach * (table - rest) + raise * (drink - table);
      const Eigen::Matrix3d turn = upright * ExpSO3(raise * LogSO3(upright.transpose() * tilted));
      made.pose.push_back(pose);
      EXPECT_LT(MoveWrist(surface.RestJoints(), Side::kRight, turn, at, Eigen::Vector3d::Zero(),
                          made.pose.back()),
                1e-6);
    }
    return made;
  }
};

TEST_F(DrinkTest, IsFoundByItsMotion) {
  const auto times = FindDrink(TrackPalms(clip, surface.RestJoints()), face);
  ASSERT_TRUE(times.has_value());
  EXPECT_EQ(times->side, Side::kRight);
  EXPECT_NEAR(times->lift, kLift, 5);
  EXPECT_NEAR(times->drink, kDrink, 3);
  EXPECT_NEAR(times->put_down, kPutDown, 5);

  const Clip still = Slice(clip, 0, 8);
  EXPECT_FALSE(FindDrink(TrackPalms(still, surface.RestJoints()), face).has_value());
}

// Both go by the mouth and on over the eyes. Who drains a cup, the head laid back, comes back the
// same way; who combs goes down behind the head.
TEST_F(DrinkTest, TellsDrainingACupFromCombing) {
  PalmTracks tracks = TrackPalms(clip, surface.RestJoints());
  const Eigen::Vector3d mouth = tracks.head[0] * face.mouth;
  const auto path = [&](const Eigen::Vector3d& behind, double over_mouth) {
    for (int t = kLift; t < kPutDown; ++t) {
      const double way = std::min(t - kLift, kPutDown - 1 - t) / 29.0;  // 0 to 1 and back
      const Eigen::Vector3d over = mouth + Eigen::Vector3d(-0.05, 0.05, over_mouth);
      Eigen::Vector3d at = mouth + Eigen::Vector3d(-0.1, -0.05, 0.0);
      if (way < 0.5) at += (0.5 - way) * Eigen::Vector3d(-0.1, -0.4, -0.7);
      if (way >= 0.5) at += MinimumJerk(4.0 * (way - 0.5)) * (over - at);
      if (way >= 0.75) at += MinimumJerk(4.0 * (way - 0.75)) * (behind - over);
      tracks.at[0].col(t) = at;
    }
    return FindDrink(tracks, face);
  };
  EXPECT_LT((tracks.forward + Eigen::Vector3d::UnitY()).norm(), 0.1);
  EXPECT_TRUE(path(mouth + Eigen::Vector3d(-0.05, 0.06, 0.23), 0.22).has_value());
  EXPECT_FALSE(path(mouth + Eigen::Vector3d(-0.05, 0.2, 0.12), 0.22).has_value());
  // By the side of the head, never far above the eyes.
  EXPECT_FALSE(path(mouth + Eigen::Vector3d(-0.1, 0.2, 0.03), 0.12).has_value());
  EXPECT_TRUE(path(mouth + Eigen::Vector3d(-0.1, 0.06, 0.1), 0.12).has_value());
}

TEST_F(DrinkTest, CupStandsIsLiftedToTheMouthAndPutBack) {
  const PreparedObject mug = PrepareObject(LoadObject("mug"));
  CarryOptions options;
  options.drink = true;
  const CarryReport carried = CarryObject(clip, {model, Eigen::VectorXd()}, mug, options);
  ASSERT_EQ(carried.status, CarryStatus::kCarried);
  ASSERT_TRUE(carried.drunk.has_value());
  EXPECT_LT(carried.drunk->rim_from_mouth_m, 0.02);
  const int lift = carried.drink->times.lift, end = carried.drink->times.put_down;
  EXPECT_GT(carried.drunk->tilt_rad, 30.0 * kDegree);
  EXPECT_LT(carried.drunk->lean_rad, 2.0 * kDegree);
  // Coming and going as well, but for a moment in which the handle is between two fingers.
  EXPECT_LE(std::ranges::count_if(carried.contact.frames,
                                  [](const auto& f) { return f.penetration_mm > kDeep_mm; }),
            2);
  const ObjectTrack& track = *carried.clip.object;
  ASSERT_TRUE(carried.clip.table.has_value());
  const Eigen::Matrix3Xd before = track.Pose(0) * mug.object.mesh.vertices;
  EXPECT_NEAR(before.row(2).minCoeff(), carried.clip.table->trans(2, 0), 0.005);
  EXPECT_LT((track.Pose(0).translation() - carried.clip.table->trans.col(0)).head<2>().norm(), 0.3);
  for (int t = 0; t < lift; ++t) EXPECT_LT((track.trans.col(t) - track.trans.col(0)).norm(), 1e-3);
  EXPECT_NEAR(track.trans(2, kFrames - 1), track.trans(2, 0), 0.003);
  EXPECT_GT(track.trans(2, carried.drink->times.drink), track.trans(2, 0) + 0.2);
  EXPECT_EQ(carried.clip.holding_hand[lift - 1], 0);
  EXPECT_EQ(carried.clip.holding_hand[lift], kHoldsRight);
  EXPECT_EQ(carried.clip.holding_hand[end], kHoldsRight);
  EXPECT_EQ(carried.clip.holding_hand[end + 1], 0);
}

// The rim of a bottle is 10 cm above that of a mug: the hand stays lower, the head does not rise.
TEST_F(DrinkTest, HandBringsTheRimOfATallBottleToAnUprightHead) {
  const PreparedObject bottle = PrepareObject(LoadObject("bottle"));
  CarryOptions options;
  options.drink = true;
  const CarryReport carried = CarryObject(clip, {model, Eigen::VectorXd()}, bottle, options);
  ASSERT_TRUE(carried.drunk.has_value());
  EXPECT_LT(carried.drunk->rim_from_mouth_m, 0.02);
  EXPECT_LT(carried.drunk->neck_rad, 30.0 * kDegree);
}

TEST_F(DrinkTest, IsFoundForVesselsUnlessTheActionIsAnother) {
  const ClipBody body{model, Eigen::VectorXd()};
  for (const char* name : {"mug", "wineglass", "bottle"}) {
    EXPECT_EQ(DrinkingHand(clip, body, PrepareObject(LoadObject(name))), Side::kRight) << name;
  }
  for (const char* name : {"cube", "bowl", "fryingpan", "lightbulb"}) {
    EXPECT_EQ(DrinkingHand(clip, body, PrepareObject(LoadObject(name))), std::nullopt) << name;
  }
  const PreparedObject mug = PrepareObject(LoadObject("mug"));
  EXPECT_EQ(DrinkingHand(Slice(clip, 0, 8), body, mug), std::nullopt);
  // Who looks at something raises it by 22 cm, to 18 cm from the mouth.
  const LoadedClip looks = LoadClip("demo_inspect");
  EXPECT_TRUE(FindDrink(TrackPalms(looks.clip, surface.RestJoints()), face).has_value());
  EXPECT_EQ(DrinkingHand(looks.clip, body, mug), std::nullopt);
  clip.action = "drink";
  EXPECT_EQ(DrinkingHand(clip, body, mug), Side::kRight);
  clip.action = "inspect";
  EXPECT_EQ(DrinkingHand(clip, body, mug), std::nullopt);
}

// What is open on top, or closed and round there, is drunk from; but nobody drinks here.
TEST_F(DrinkTest, SaysWhatHasNoRimAndWhereNobodyDrinks) {
  Clip still = Slice(clip, 0, 8);
  const auto answer = [&](const char* name) {
    const PreparedObject object = PrepareObject(LoadObject(name));
    return testing::ErrorText([&] { ServeDrink({model, Eigen::VectorXd()}, object, 1, still); });
  };
  for (const char* name : {"cube", "banana", "phone", "apple"}) {
    EXPECT_THAT(answer(name), ::testing::HasSubstr("has no rim to drink from")) << name;
  }
  for (const char* name : {"mug", "wineglass", "bowl", "bottle", "cylinder"}) {
    EXPECT_THAT(answer(name), ::testing::HasSubstr("from a table to the mouth")) << name;
  }
}

}  // namespace
}  // namespace holdfast
