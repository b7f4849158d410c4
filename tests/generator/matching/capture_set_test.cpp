// SPDX-License-Identifier: MIT
#include "generator/matching/capture_set.h"

#include <gtest/gtest.h>

#include "geometry/error.h"
#include "tests/support/capture_folder.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using testing::TemporaryFolder;

std::optional<CaptureSet> ImportWithoutBob(const TemporaryFolder& folder,
                                           const StagedProgress& progress = {}) {
  return ImportCaptures(folder / "captures", folder / "cache", *BodyModel::Default(), {"bob"}, 2,
                        progress);
}

TEST(ImportCaptures, SplitsByPersonAndFindsWhatToLearnFrom) {
  const TemporaryFolder folder;
  testing::WriteCaptures(folder / "captures");
  const std::optional<CaptureSet> set = ImportWithoutBob(folder);
  ASSERT_TRUE(set.has_value());
  EXPECT_EQ(set->name, "captures");
  ASSERT_EQ(set->captures.size(), 5u);
  EXPECT_EQ(set->dropped, 0);
  EXPECT_EQ(set->reach_sources, 2);
  EXPECT_NEAR(set->held_out_minutes, 90 / 30.0 / 60.0, 1e-9);
  EXPECT_NEAR(set->train_minutes, (120 + 240 + 2 * 121) / 30.0 / 60.0, 1e-9);
  EXPECT_EQ(set->held_out.frames, 90);
  EXPECT_EQ(set->train.frames, 120 + 240 + 2 * 121);
  for (const Capture& capture : set->captures) {
    EXPECT_EQ(capture.held_out, capture.subject == "bob") << capture.file;
    EXPECT_TRUE(exists(folder / "cache" / (capture.held_out ? "held_out" : "train") /
                       (capture.name + ".npz")));
  }
  for (const LibraryClip& clip : set->library.Clips()) EXPECT_NE(clip.name, "walk_other");
  // Once more, from the cache.
  EXPECT_EQ(ImportWithoutBob(folder)->joint_limits, set->joint_limits);
}

TEST(ImportCaptures, StopsWhenAskedTo) {
  const TemporaryFolder folder;
  testing::WriteCaptures(folder / "captures");
  int calls = 0;
  EXPECT_FALSE(ImportWithoutBob(folder, [&](const char*, int, int) { return ++calls < 2; }));
  EXPECT_LE(calls, 3);  // the other thread's as well
}

TEST(ImportCaptures, SaysWhoIsThere) {
  const TemporaryFolder folder;
  testing::WriteCaptures(folder / "captures");
  EXPECT_THROW(
      ImportCaptures(folder / "captures", folder / "cache", *BodyModel::Default(), {"eve"}, 2),
      Error);
}

TEST(CaptureName, IsThePathWithoutEnding) {
  EXPECT_EQ(CaptureName("cmu/08/walk.bvh.gz"), "cmu_08_walk");
  EXPECT_EQ(CaptureName("turn.npz"), "turn");
}

}  // namespace
}  // namespace holdfast
