// SPDX-License-Identifier: MIT
#include "generator/walk_statistics/naturalness.h"

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "tests/generator/test_body.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/walking_figure.h"

namespace holdfast {
namespace {

// Captured walks of about one speed, and a set with one that hurries and one that stands.
class Naturalness : public ::testing::Test {
 protected:
  Naturalness() {
    std::filesystem::create_directories(folder_ / "captured/person");
    std::filesystem::create_directory(folder_ / "made");
    const BodyMeasures& body = DefaultMeasures();
    WriteClip(testing::WalkingFigure(body, 120, 0.95), folder_ / "captured/person/a.npz");
    WriteClip(testing::WalkingFigure(body, 120, 1.05), folder_ / "captured/person/b.npz");
    WriteClip(testing::WalkingFigure(body, 120, 2.4), folder_ / "made/fast.npz");
    WriteClip(testing::StandingFigure(body, 60), folder_ / "made/standing.npz");
    for (const char* name : {"captured", "made"}) {
      sets_.push_back({name, MotionFilesOf((folder_ / name).string())});
    }
  }

  testing::TemporaryFolder folder_;
  std::vector<MotionSet> sets_;
};

TEST_F(Naturalness, ComparesSetsWithTheFirst) {
  EXPECT_EQ(sets_[0].files[0].name, "person/a");
  const NaturalnessStudy study = CompareNaturalness(sets_);
  ASSERT_EQ(study.columns.size(), 2u);
  EXPECT_FALSE(study.stopped);
  EXPECT_EQ(study.columns[1].NumMotions(), 2);
  EXPECT_EQ(study.columns[1].NumWalks(), 1);
  EXPECT_GT(study.columns[1].mean_distance, 0.1);
  EXPECT_EQ(study.columns[0].mean_distance, 0.0);
  EXPECT_THAT(study.notes, ::testing::Contains("Joint limits are those of the reference."));
  NaturalnessOptions options;
  options.threads = 3;
  options.limits = sets_[0];
  const NaturalnessStudy again = CompareNaturalness(sets_, options);
  EXPECT_EQ(again.columns[1].mean_distance, study.columns[1].mean_distance);
  EXPECT_THAT(again.notes, ::testing::Contains("Joint limits are those of captured."));
}

TEST_F(Naturalness, LeavesOutAndStops) {
  NaturalnessOptions options;
  options.moving_only = true;
  int last = 0;
  options.progress = [&](int done, int total) {
    EXPECT_EQ(total, 4);
    last = done;
    return true;
  };
  EXPECT_EQ(CompareNaturalness(sets_, options).columns[1].files, std::vector<std::string>{"fast"});
  EXPECT_EQ(last, 4);
  options.progress = {};
  sets_[1].files.erase(sets_[1].files.begin());
  EXPECT_THROW(CompareNaturalness(sets_, options), Error);
  options.progress = [](int, int) { return false; };
  EXPECT_TRUE(CompareNaturalness(sets_, options).stopped);
}

}  // namespace
}  // namespace holdfast
