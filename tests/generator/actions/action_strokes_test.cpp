// SPDX-License-Identifier: MIT
#include "generator/actions/action_strokes.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "generator/matching/body_frame.h"
#include "generator/scripted/reach_motion.h"
#include "geometry/object/load_object.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

// A right hand lifts a hammer, its handle up and its face to the front, and holds it there.
struct HeldHammer {
  HeldHammer() : body(MeasureBody(*BodyModel::Default(), {})) {
    marks = MarksOf("hammer", LoadObject("hammer").mesh);
    ReachKey start, up, stays;
    start.wrist = {-0.25, -0.2, 0.95};
    up.time_s = 0.8;
    up.wrist = {-0.15, -0.35, 1.2};
    stays = up;
    stays.time_s = 4.0;
    clip = MakeReachMotion(body, {start, up, stays}, {.liveliness = 0.0});
    clip.object.emplace();
    clip.object->trans = clip.object->orient = Eigen::Matrix3Xd::Zero(3, clip.NumFrames());
    const Isometry3d last = Wrist(clip, clip.NumFrames() - 1);
    // x of the hammer up, y to the front (-y of the world): z to the right.
    Eigen::Matrix3d R;
    R << 0, 0, -1, 0, -1, 0, 1, 0, 0;
    const Isometry3d in_wrist = last.inverse() * RigidTransform(R, last.translation());
    for (int t = 0; t < clip.NumFrames(); ++t) clip.object->SetPose(t, Wrist(clip, t) * in_wrist);
  }
  Isometry3d Wrist(const Clip& of, int t) const {
    return Place(body.rest_joints, BodyFrames(of, body.rest_joints)[static_cast<std::size_t>(t)])
        .WorldFromJoint(kRightWrist);
  }
  // Heights of the head of the hammer.
  std::vector<double> Head(const Clip& of) const {
    std::vector<double> heights;
    for (int t = 0; t < of.NumFrames(); ++t)
      heights.push_back((of.object->Pose(t) * marks.tip).z());
    return heights;
  }

  BodyMeasures body;
  ObjectMarks marks;
  Clip clip;
};

// Times that it rises, then falls, by 15 cm.
int Blows(const std::vector<double>& heights) {
  int blows = 0;
  double low = heights[0], high = heights[0];
  bool rises = true;
  for (const double z : heights) {
    if (rises) {
      high = std::max(high, z);
      if (z < high - 0.15) rises = false, low = z, ++blows;
    } else {
      low = std::min(low, z);
      if (z > low + 0.15) rises = true, high = z;
    }
  }
  return blows;
}

TEST(ActionStrokes, AHammerRisesAndComesDownAgain) {
  const HeldHammer held;
  Clip clip = held.clip;
  AddStrokes(held.body.rest_joints, "use", held.marks, 1, clip.NumFrames(), clip);
  const std::vector<double> head = held.Head(clip);
  const int blows = Blows(head);
  EXPECT_GE(blows, 2);
  EXPECT_LE(blows, 5);
  const int last = clip.NumFrames() - 1;
  const Vector3d handle = clip.object->Pose(last).linear() * held.marks.forward;
  EXPECT_LT(std::abs(std::asin(handle.z())), 40 * kDegree) << "level where it strikes, as near as "
                                                              "wrists allow; it was upright";
}

TEST(ActionStrokes, BlowsTakeThePlaceOfThoseThatAreThere) {
  const HeldHammer held;
  const auto with = [&](std::uint64_t seed, Clip clip) {
    AddStrokes(held.body.rest_joints, "use", held.marks, seed, clip.NumFrames(), clip);
    return clip;
  };
  const std::vector<double> once = held.Head(with(1, held.clip));
  const std::vector<double> twice = held.Head(with(1, with(2, held.clip)));
  EXPECT_NEAR(Blows(twice), Blows(once), 1);
  const auto [low, high] = std::ranges::minmax(once);
  const auto [low_again, high_again] = std::ranges::minmax(twice);
  EXPECT_NEAR(high_again - low_again, high - low, 0.2 * (high - low));
}

TEST(ActionStrokes, TheObjectStaysInTheHandAndTheWayThereIsAsItWas) {
  const HeldHammer held;
  for (const char* action : {"use", "shake", "chop", "cook", "brush", "inspect"}) {
    Clip clip = held.clip;
    AddStrokes(held.body.rest_joints, action, held.marks, 3, clip.NumFrames(), clip);
    EXPECT_EQ(clip.pose[5], held.clip.pose[5]) << action;
    double moved = 0.0;
    for (int t = 0; t < clip.NumFrames(); t += 3) {
      const Isometry3d is = held.Wrist(clip, t).inverse() * clip.object->Pose(t);
      const Isometry3d was = held.Wrist(held.clip, t).inverse() * held.clip.object->Pose(t);
      EXPECT_LT((is.matrix() - was.matrix()).cwiseAbs().maxCoeff(), 2e-3) << action << t;
      moved = std::max(moved, (clip.object->Pose(t).matrix() - held.clip.object->Pose(t).matrix())
                                  .cwiseAbs()
                                  .maxCoeff());
    }
    EXPECT_GT(moved, 0.007) << action;
  }
}

TEST(ActionStrokes, OfASeedAreTheSameAndOtherActionsHaveNone) {
  const HeldHammer held;
  Clip one = held.clip, same = held.clip, other = held.clip, drink = held.clip;
  AddStrokes(held.body.rest_joints, "use", held.marks, 1, one.NumFrames(), one);
  AddStrokes(held.body.rest_joints, "use", held.marks, 1, one.NumFrames(), same);
  AddStrokes(held.body.rest_joints, "use", held.marks, 2, one.NumFrames(), other);
  AddStrokes(held.body.rest_joints, "drink", held.marks, 1, one.NumFrames(), drink);
  EXPECT_EQ(one.pose, same.pose);
  EXPECT_NE(one.pose, other.pose);
  EXPECT_EQ(drink.pose, held.clip.pose);
}

TEST(ObjectMarks, TurnedOverAHammerHasItsFaceOnTheOtherSideOfTheSameHandle) {
  const ObjectMarks hammer = MarksOf("hammer", LoadObject("hammer").mesh);
  ASSERT_TRUE(hammer.two_sided);
  EXPECT_FALSE(MarksOf("mug", LoadObject("mug").mesh).two_sided);
  EXPECT_LT((TurnedOver() * hammer.forward - hammer.forward).norm(), 1e-12);
  EXPECT_LT((TurnedOver() * hammer.facing + hammer.facing).norm(), 1e-12);
  EXPECT_GT(TurnedOver().linear().determinant(), 0.0);
}

}  // namespace
}  // namespace holdfast
