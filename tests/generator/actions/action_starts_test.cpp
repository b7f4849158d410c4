// SPDX-License-Identifier: MIT
#include "generator/actions/standing_start.h"

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "tests/generator/test_body.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/walking_figure.h"

namespace holdfast {
namespace {

using ::testing::ElementsAre;

TEST(FindActionStarts, KeepsPeopleApart) {
  const testing::TemporaryFolder folder;
  for (const char* person : {"ann", "bob", "cyd"}) {
    std::filesystem::create_directories(folder / person);
    WriteClip(testing::StandingFigure(DefaultMeasures(), 120), folder / person / "stand.npz");
  }
  const auto find = [&](const std::vector<std::string>& held_out) {
    return FindActionStarts(folder.Path().string(), held_out, *BodyModel::Default(), 1, 2);
  };
  const ActionStarts starts = find({"bob"});
  EXPECT_THAT(starts.train_people, ElementsAre("ann", "cyd"));
  EXPECT_THAT(starts.held_out_people, ElementsAre("bob"));
  EXPECT_THAT(starts.asked_held_out, ElementsAre("bob"));
  for (const StandingStart& start : starts.held_out) EXPECT_EQ(start.person, "bob");
  EXPECT_THROW(find({"eve"}), Error);
  EXPECT_THROW(find({"ann", "bob", "cyd"}), Error);
}

TEST(FindActionStarts, HasStartsOfItsOwn) {
  const ActionStarts starts = FindActionStarts("", {}, *BodyModel::Default(), 7, 1);
  EXPECT_EQ(starts.name, "own");
  EXPECT_EQ(starts.train.size(), 40u);
  EXPECT_EQ(starts.held_out.size(), 40u);
}

}  // namespace
}  // namespace holdfast
