// SPDX-License-Identifier: MIT
#include "solver/markers/marker_world.h"

#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "tests/support/error_text.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

void Record(const fs::path& file) {
  fs::create_directories(file.parent_path());
  std::ofstream(file) << "Trajectories\n100\n,,a:STRN,,\nFrame,Sub Frame,X,Y,Z\n"
                         ",,mm,mm,mm\n1,0,10,20,30\n";
}

TEST(FindMarkerTrials, StaticTrialsAreThoseOfTheFolder) {
  const testing::TemporaryFolder folder;
  for (const char* file : {"anna/walk.csv", "anna/still_static.csv", "bert/drink.csv"}) {
    Record(folder / file);
  }
  std::ofstream(folder / "anna/index.csv") << "file,frames\n";
  const auto trials = FindMarkerTrials(folder.Path());
  ASSERT_EQ(trials.size(), 2u);
  EXPECT_EQ(trials[0].name, "walk");
  EXPECT_EQ(trials[0].still.filename(), "still_static.csv");
  EXPECT_EQ(trials[1].name, "drink");
  EXPECT_TRUE(trials[1].still.empty());
  EXPECT_EQ(trials[1].Person(), "bert");
}

TEST(FindMarkerTrials, OfSeveralTheNameTells) {
  const testing::TemporaryFolder folder;
  for (const char* file : {"P1_static.csv", "P12_static.csv", "P1drink.csv", "P12drink.csv"}) {
    Record(folder / file);
  }
  const auto trials = FindMarkerTrials(folder.Path());
  ASSERT_EQ(trials.size(), 2u);
  EXPECT_EQ(trials[0].still.filename(), "P12_static.csv");
  EXPECT_EQ(trials[1].still.filename(), "P1_static.csv");
  EXPECT_EQ(trials[1].Person(), "P1");

  Record(folder / "drink.csv");
  EXPECT_THAT(testing::ErrorText([&] { FindMarkerTrials(folder.Path()); }),
              ::testing::HasSubstr("several static trials"));
}

}  // namespace
}  // namespace holdfast
