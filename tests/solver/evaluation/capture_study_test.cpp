// SPDX-License-Identifier: MIT
#include "solver/evaluation/capture_study.h"

#include <cmath>
#include <filesystem>

#include <gtest/gtest.h>

#include "geometry/import/load_clip.h"
#include "geometry/parallel.h"
#include "solver/carry/carry.h"
#include "tests/support/data_folder.h"

namespace holdfast {
namespace {

CaptureRow Row(const std::string& name, int frames, int deep, int contact) {
  CaptureRow row;
  row.name = name;
  row.frames = row.hand_frames = frames;
  row.fingers_move = name != "a";
  row.after.deep_frames = deep;
  row.after.deepest_mm = 0.5 * deep;
  row.after.hand_frames_in_contact = contact;
  row.after.tips = {.touch = frames, .beside = 4 * frames, .inside = 0};
  row.wrist_rms_mm = 10.0 * deep;
  return row;
}

TEST(SumsOfCaptureStudy, AreOfAllClipsThatWereRefined) {
  CaptureRow failed = Row("c", 70, 70, 0);
  failed.fault = "no hand";
  const std::vector<CaptureRow> rows = {Row("a", 100, 0, 80), failed, Row("b", 300, 4, 300)};
  const CaptureSums sums = SumsOf(rows);
  EXPECT_EQ(sums.refined, 2);
  EXPECT_EQ(sums.flat, 1);
  EXPECT_EQ(sums.all.frames, 400);
  EXPECT_EQ(sums.all.after.deep_frames, 4);
  EXPECT_EQ(sums.all.after.tips.beside, 1600);
  EXPECT_NEAR(sums.all.DeepShare(), 0.01, 1e-12);
  EXPECT_NEAR(sums.all.ContactShare(), 0.95, 1e-12);
  EXPECT_NEAR(sums.all.wrist_rms_mm, std::sqrt(0.75 * 1600.0), 1e-9);
  EXPECT_EQ(rows[*sums.worst_depth].name, "b");
  EXPECT_EQ(rows[*sums.worst_contact].name, "a");
  EXPECT_FALSE(SumsOf({failed}).worst_depth);
}

TEST(StudyCaptures, MeasuresAHoldBeforeAndAfterAndNamesWhatIsNotRefined) {
  LoadedClip motion = LoadClip("demo_drink");
  motion.clip = Slice(motion.clip, 0, 10);
  const auto mug = std::make_shared<const PreparedObject>(PrepareObject(LoadObject("mug")));
  ObjectCapture held{"held", CarryObject(motion.clip, motion.body, *mug).clip, motion.body, mug};
  ObjectCapture away = held;
  away.name = "away";
  away.clip.object->trans.row(1).array() += 5.0;
  int seen = 0;
  const std::vector<CaptureRow> rows =
      StudyCaptures({held, away}, 2, [&](int, int total) { return ++seen <= total; });
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(seen, 2);
  EXPECT_EQ(rows[0].name, "held");
  EXPECT_EQ(rows[0].fault, "");
  EXPECT_EQ(rows[0].hand_frames, 10);
  EXPECT_EQ(rows[0].after.deep_frames, 0);
  EXPECT_EQ(rows[0].ContactShare(), 1.0);
  EXPECT_NE(rows[1].fault, "");
  EXPECT_THROW(StudyCaptures({away}, 1, [](int, int) { return false; }), WorkStopped);
}

TEST(StudyCaptures, ACapturedReboundHasNoJumpsNoDepthAndTheBallInHand) {
  const auto path = testing::DataFolder() / "skillmimic/rebound/002_023pickle_rebound_6.pt";
  if (!std::filesystem::exists(path)) {
    GTEST_SKIP() << path << " is not there: set HOLDFAST_DATA to the folder with skillmimic/";
  }
  ImportFileOptions as_it_is;
  as_it_is.frame_rate = 0.0;
  const LoadedClip rebound = LoadClip(path.string(), as_it_is);
  const ClipObject ball = FindClipObject(rebound);
  ASSERT_TRUE(ball.mesh);
  const auto prepared = std::make_shared<const PreparedObject>(
      PrepareObject(ObjectOfMesh(*ball.mesh, "ball", ball.source)));
  const CaptureRow row =
      StudyCaptures({{"rebound", rebound.clip, rebound.body, prepared}}, 1).front();
  ASSERT_EQ(row.fault, "");
  EXPECT_TRUE(row.fingers_move);
  EXPECT_GT(row.before.jump_frames, 0);
  EXPECT_EQ(row.after.jump_frames, 0);
  EXPECT_EQ(row.after.deep_frames, 0);
  EXPECT_GT(row.hand_frames, 10);
  EXPECT_GE(row.ContactShare(), 0.95);
}

}  // namespace
}  // namespace holdfast
