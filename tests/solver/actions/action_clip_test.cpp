// SPDX-License-Identifier: MIT
#include "solver/actions/action_clip.h"

#include <filesystem>

#include <gtest/gtest.h>

#include "geometry/clip/clip_arrays.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

TriangleMesh Embedded(const std::string& name) {
  return ReadMesh(std::filesystem::path(HOLDFAST_MESHES_DIR) / "objects" / (name + ".ply"));
}

const ActionActor& Actor() {
  static const ActionActor actor(BodyModel::Default(), Eigen::VectorXd::Zero(10));
  return actor;
}

const ActionProp& Mug() {
  static const ActionProp mug =
      MakeActionProp("mug", Embedded("mug"), Embedded("mug_300"), false, 1);
  return mug;
}

const ActionGrasps& MugGrasps() {
  static const ActionGrasps grasps(Actor(),
                                   FindActionGrasps(Actor().Hand(Side::kRight), Mug(), 1, 8), {});
  return grasps;
}

ActionClip Drink(std::uint64_t seed, bool mirrored = false) {
  const StandingStart start = OwnStanding(Actor().Measures(), 5);
  return MakeActionClip({"drink", Actor(), Mug(), MugGrasps(), start, mirrored, seed});
}

Isometry3d ObjectAt(const Clip& clip, int t) {
  Isometry3d pose = Isometry3d::Identity();
  pose.linear() = ExpSO3(clip.object->orient.col(t));
  pose.translation() = clip.object->trans.col(t);
  return pose;
}

TEST(ActionClip, DrinksWithTheRimAtTheMouthAndNothingInTheFace) {
  int sound = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const ActionClip made = Drink(seed);
    if (!made.fault.empty()) continue;
    ++sound;
    const Clip& clip = made.clip;
    EXPECT_EQ(clip.action, "drink");
    EXPECT_EQ(clip.object->name, "mug");
    ASSERT_EQ(static_cast<int>(clip.holding_hand.size()), clip.NumFrames());
    double least = 1.0, tilt = 1.0;
    BodyState state;
    for (int t = 0; t < clip.NumFrames(); ++t) {
      ForwardJoints(Actor().Measures().rest_joints, clip.pose[t], clip.trans.col(t), state);
      const Vector3d mouth = state.joints.col(15) + state.world_rotation[15] * Actor().Face().mouth;
      const Vector3d in_mug = ObjectAt(clip, t).inverse() * mouth - Mug().marks.rim;
      const double off = std::hypot(in_mug.head<2>().norm() - Mug().marks.rim_radius, in_mug.z());
      if (off < least) least = off;
      if (off < 0.015) tilt = std::min(tilt, ObjectAt(clip, t).linear()(2, 2));
    }
    EXPECT_LT(least, 0.012);
    EXPECT_LT(tilt, 0.85);  // the mug's axis off the vertical: more than 30 degrees
    EXPECT_LT(made.quality.object_in_body_mm, 5.0);
    EXPECT_GE(made.quality.contact, 0.98);
    EXPECT_EQ(made.quality.skate, 0.0);
    // Half a second of nothing to begin with.
    for (int t = 1; t < 15; ++t) {
      EXPECT_LT((clip.object->trans.col(t) - clip.object->trans.col(0)).norm(), 0.004);
    }
  }
  EXPECT_GE(sound, 2);
}

TEST(ActionClip, IsTheSameForTheSameSeed) {
  const ActionClip one = Drink(3), two = Drink(3);
  ASSERT_EQ(one.clip.NumFrames(), two.clip.NumFrames());
  for (int t = 0; t < one.clip.NumFrames(); ++t) ASSERT_EQ(one.clip.pose[t], two.clip.pose[t]);
  EXPECT_EQ(one.clip.object->trans, two.clip.object->trans);
}

TEST(ActionClip, MirroredIsLeftHandedAndMirrorsBack) {
  const ActionClip right = Drink(3), left = Drink(3, true);
  ASSERT_GT(right.clip.NumFrames(), 0);
  EXPECT_EQ(left.clip.holding_hand.front(), kHoldsLeft);
  const Clip back = MirrorClip(left.clip, Actor().Measures().rest_joints.col(0));
  for (int t = 0; t < back.NumFrames(); ++t) {
    EXPECT_EQ(back.pose[t], right.clip.pose[t]);
  }
  EXPECT_LT((back.trans - right.clip.trans).cwiseAbs().maxCoeff(), 1e-12);
  // The same body, whose pelvis at rest is not at x = 0.
  BodyState left_state, right_state;
  const Eigen::Matrix3Xd& rest = Actor().Measures().rest_joints;
  ForwardJoints(rest, left.clip.pose[7], left.clip.trans.col(7), left_state);
  ForwardJoints(rest, right.clip.pose[7], right.clip.trans.col(7), right_state);
  for (int j = 0; j < kNumJoints; ++j) {
    const Vector3d mirrored = Vector3d(-1.0, 1.0, 1.0).cwiseProduct(right_state.joints.col(j));
    EXPECT_LT((left_state.joints.col(MirrorJoint(j)) - mirrored).norm(), 1e-6) << kJointNames[j];
  }
  EXPECT_EQ(back.object->orient, right.clip.object->orient);
  EXPECT_EQ(back.holding_hand, right.clip.holding_hand);
  // A point of the reflected object in the unmirrored world is the reflection of that of the
  // object in the mirrored one.
  const Vector3d flip(-1.0, 1.0, 1.0), point(0.01, 0.02, 0.03);
  const Vector3d mirrored = ObjectAt(left.clip, 7) * point;
  const Vector3d original = ObjectAt(right.clip, 7) * flip.cwiseProduct(point);
  EXPECT_LT((mirrored - flip.cwiseProduct(original)).norm(), 1e-12);
}

TEST(ActionClip, SaysWhyWhenNoHandCanHoldTheObject) {
  TriangleMesh crate = Embedded("cube"), simple = Embedded("cube_300");
  crate.vertices *= 6.0;
  simple.vertices *= 6.0;
  const ActionProp prop = MakeActionProp("cube", crate, simple, false, 1);
  GraspStatus status = GraspStatus::kFound;
  std::vector<Grasp> none = FindActionGrasps(Actor().Hand(Side::kRight), prop, 1, 8, &status);
  EXPECT_TRUE(none.empty());
  EXPECT_NE(status, GraspStatus::kFound);
  const ActionGrasps grasps(Actor(), none, {});
  const StandingStart start = OwnStanding(Actor().Measures(), 5);
  EXPECT_EQ(MakeActionClip({"lift", Actor(), prop, grasps, start, false, 1}).fault, "no grasp");
  EXPECT_FALSE(MakeActionClip({"offhand", Actor(), prop, grasps, start, false, 1}).fault.empty());
}

// How often a height falls by so much.
int Falls(const std::vector<double>& heights, double by_m) {
  int count = 0;
  double high = heights.front(), low = high;
  bool rises = true;
  for (const double z : heights) {
    high = std::max(high, z);
    low = std::min(low, z);
    if (rises && z < high - by_m) rises = false, low = z, ++count;
    if (!rises && z > low + by_m) rises = true, high = z;
  }
  return count;
}

TEST(ActionClip, HammersWithTheWholeArmOrTheWristAlone) {
  const ActionProp hammer =
      MakeActionProp("hammer", Embedded("hammer"), Embedded("hammer_300"), false, 1);
  std::vector<Grasp> grips = FindActionGrasps(Actor().Hand(Side::kRight), hammer, 1, 16);
  AddTurnedOver(hammer.marks, grips);
  const ActionGrasps grasps(Actor(), grips, {});
  const StandingStart start = OwnStanding(Actor().Measures(), 5);
  for (const bool of_wrist : {false, true}) {
    int sound = 0, head_falls = 0, wrist_as_asked = 0;  // clips
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
      const ActionClip made =
          MakeActionClip({"use", Actor(), hammer, grasps, start, false, seed, of_wrist});
      if (!made.fault.empty()) continue;
      ++sound;
      const Clip& clip = made.clip;
      std::vector<double> head, wrist;
      BodyState state;
      for (int t = 0; t < clip.NumFrames(); ++t) {
        head.push_back((ObjectAt(clip, t) * hammer.marks.tip).z());
        ForwardJoints(Actor().Measures().rest_joints, clip.pose[t], clip.trans.col(t), state);
        wrist.push_back(state.joints(2, 21));
      }
      head_falls += Falls(head, of_wrist ? 0.05 : 0.15) >= 2;
      wrist_as_asked += of_wrist ? Falls(wrist, 0.06) == 0 : Falls(wrist, 0.06) >= 2;
      EXPECT_GE(made.quality.contact, 0.98) << of_wrist;
      EXPECT_LT(made.quality.object_in_body_mm, 5.0) << of_wrist;
    }
    ASSERT_GE(sound, 3) << of_wrist;
    // The wrist alone strikes less far, and the arm is lowered in some of the clips.
    const int most = of_wrist ? (sound + 1) / 2 : sound;
    EXPECT_GE(head_falls, most) << of_wrist;
    EXPECT_GE(wrist_as_asked, most) << of_wrist;
  }
}

}  // namespace
}  // namespace holdfast
