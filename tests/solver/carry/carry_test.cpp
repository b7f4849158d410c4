// SPDX-License-Identifier: MIT
#include "solver/carry/carry.h"

#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/import/load_clip.h"
#include "solver/carry/refine.h"

namespace holdfast {
namespace {

const PreparedObject& Mug() {
  static const PreparedObject mug = PrepareObject(LoadObject("mug"));
  return mug;
}

// The demo's first frames, and its person.
LoadedClip Beginning(int frames) {
  LoadedClip loaded = LoadClip("demo_drink");
  loaded.clip = Slice(loaded.clip, 0, frames);
  return loaded;
}

TEST(CarryObject, TakesHoldAndHoldsInEveryFrameAndCanBeRefined) {
  const LoadedClip motion = Beginning(12);
  std::set<std::string> stages;
  const CarryReport held =
      CarryObject(motion.clip, motion.body, Mug(), {}, [&](const char* stage, int done, int total) {
        EXPECT_LE(done, total);
        stages.insert(stage);
        return true;
      });
  ASSERT_EQ(held.status, CarryStatus::kCarried);
  EXPECT_EQ(stages, (std::set<std::string>{"fit", "grasp", "metrics"}));
  EXPECT_TRUE(held.grasp.made);
  EXPECT_EQ(held.held_by, kHoldsRight);
  EXPECT_EQ(held.clip.NumFrames(), 12);
  EXPECT_EQ(held.clip.object->name, "mug");
  EXPECT_EQ(held.contact.contact_frames_ratio, 1.0);
  EXPECT_LT(held.contact.penetration_max_mm, 2.0);
  EXPECT_EQ(held.fit.frames.size(), 12u);

  const RefineReport refined = RefineCarried(held.clip, motion.body, Mug());
  ASSERT_EQ(refined.status, RefineStatus::kRefined);
  // One function measures both.
  EXPECT_EQ(refined.before.contact.penetration_max_mm, held.contact.penetration_max_mm);
  EXPECT_EQ(refined.distance.mm.size(), 12u);
  EXPECT_LT(refined.distance.rms_mm, 2.0);
  // Nothing was moved between a clip and itself.
  EXPECT_EQ(DistanceToData(held.clip, held.clip).rms_mm, 0.0);
}

TEST(CarryObject, StopsWhereItIsToldTo) {
  const LoadedClip motion = Beginning(4);
  for (const std::string last : {"grasp", "fit", "metrics"}) {
    std::string seen;
    const CarryReport report =
        CarryObject(motion.clip, motion.body, Mug(), {}, [&](const char* stage, int, int) {
          seen = stage;
          return stage != last;
        });
    EXPECT_EQ(report.status, CarryStatus::kStopped) << last;
    EXPECT_EQ(seen, last);
  }
}

TEST(CarryObject, PassesAMugWithoutAHandGoingThroughItsWall) {
  const LoadedClip motion = LoadClip("demo_pass");
  CarryOptions options;
  options.hand_over = true;
  options.threads = 2;
  const CarryReport passed = CarryObject(motion.clip, motion.body, Mug(), options);
  ASSERT_EQ(passed.status, CarryStatus::kCarried);
  ASSERT_EQ(passed.handovers.size(), 1u);
  const GraspTransfer& transfer = passed.handovers.front().transfer;
  EXPECT_TRUE(transfer.found) << transfer.refused;
  // Both ways: a finger through the wall has the mug's vertices inside it. On the way in and out,
  // too.
  for (std::size_t t = 0; t < passed.contact.frames.size(); ++t) {
    EXPECT_LT(passed.contact.frames[t].penetration_mm, 2.0) << t;
  }
  EXPECT_LT(transfer.correction_m, 0.07);
  EXPECT_LT(transfer.correction_rad, 0.6);
}

TEST(NeedsGrasp, WhereTheClipHasNoneOfThisObject) {
  const LoadedObject& mug = Mug().object;
  Clip clip = Beginning(2).clip;
  CarryOptions options, anew, keep;
  anew.grasp = GraspSource::kNew;
  keep.grasp = GraspSource::kClips;
  EXPECT_TRUE(NeedsGrasp(clip, mug, options));
  clip.object.emplace();
  clip.object->name = "MUG";
  EXPECT_FALSE(NeedsGrasp(clip, mug, options));
  EXPECT_TRUE(NeedsGrasp(clip, mug, anew));
  clip.object->name = "apple";
  EXPECT_TRUE(NeedsGrasp(clip, mug, options));
  EXPECT_FALSE(NeedsGrasp(clip, mug, keep));
  // Where the surface is known the name says nothing.
  options.clip_object = mug.mesh;
  EXPECT_FALSE(NeedsGrasp(clip, mug, options));
  clip.object->name = "mug";
  options.clip_object = LoadObject("apple").mesh;
  EXPECT_TRUE(NeedsGrasp(clip, mug, options));
  EXPECT_EQ(WhyNewGrasp(clip, mug, "mug", options),
            "the clip's grasp is of another mesh named mug");
  EXPECT_EQ(WhyNewGrasp(clip, mug, "mug.ply", options),
            "the clip's grasp is of mug, not of mug.ply");
  // A hand of another kind of body model holds nothing here.
  options.clip_object = mug.mesh;
  EXPECT_EQ(WhyNewGrasp(clip, mug, "mug", options), "");
  options.other_body = keep.other_body = "SMPL-X";
  EXPECT_TRUE(NeedsGrasp(clip, mug, options));
  EXPECT_THAT(WhyNewGrasp(clip, mug, "mug", options), ::testing::HasSubstr("a hand of SMPL-X"));
  EXPECT_FALSE(NeedsGrasp(clip, mug, keep));
  options.other_body.clear();
  // A mesh in millimeters, loaded with the scale of meters.
  options.clip_object = mug.mesh;
  options.clip_object->vertices *= 1000.0;
  options.object_scale = 0.001;
  EXPECT_FALSE(NeedsGrasp(clip, mug, options));
}

// Halfway the object jumps out of the hand: what is smooth goes through the fingers, and without
// the terms of penetration nothing keeps it out of them.
TEST(RefineCarried, NeverGoesDeeperThanTheClip) {
  const LoadedClip motion = Beginning(12);
  const CarryReport held = CarryObject(motion.clip, motion.body, Mug());
  ASSERT_EQ(held.status, CarryStatus::kCarried);
  Clip clip = held.clip;
  for (int t = 0; t < 12; ++t) {
    clip.object->trans(0, t) += t < 6 ? 0.0 : 0.08;
  }
  RefineOptions options;
  options.hands = RefineHands::kRight;
  options.fit.lambda_penetration = options.fit.lambda_object_in_hand = 0.0;
  const RefineReport report = RefineCarried(clip, motion.body, Mug(), options);
  ASSERT_EQ(report.status, RefineStatus::kRefined);
  EXPECT_LE(report.after.contact.penetration_max_mm,
            report.before.contact.penetration_max_mm + 1e-9);
  ASSERT_FALSE(report.kept.empty());
  for (const FrameRange& kept : report.kept) {
    ASSERT_LT(kept.begin, kept.end);
    for (int t = kept.begin; t < kept.end; ++t) {
      EXPECT_EQ(report.result.clip.pose[t], clip.pose[t]) << t;
      EXPECT_LT((report.result.clip.object->Pose(t).matrix() - clip.object->Pose(t).matrix())
                    .cwiseAbs()
                    .maxCoeff(),
                1e-9)
          << t;
    }
  }
}

TEST(RefineCarried, SaysWhatIsMissing) {
  const LoadedClip motion = Beginning(3);
  EXPECT_THROW(RefineCarried(motion.clip, motion.body, Mug()), Error);
  Clip far = motion.clip;
  far.object.emplace();
  far.object->trans = Eigen::Matrix3Xd::Constant(3, 3, 5.0);
  far.object->orient.setZero(3, 3);
  EXPECT_THROW(RefineCarried(far, motion.body, Mug()), Error) << "nobody holds it";
  far.holding_hand.clear();
  RefineOptions of_clip;
  of_clip.hands = RefineHands::kOfClip;
  EXPECT_THROW(RefineCarried(far, motion.body, Mug(), of_clip), Error);
}

}  // namespace
}  // namespace holdfast
