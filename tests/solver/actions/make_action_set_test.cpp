// SPDX-License-Identifier: MIT
#include "solver/actions/make_action_set.h"

#include <gtest/gtest.h>

#include "geometry/error.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

class MakeActionSetTest : public ::testing::Test {
 protected:
  MakeActionSetTest() {
    options_.count = 1;
    options_.subjects = 2;
    options_.actions = {"lift"};
    options_.objects = {"cylinder"};
    options_.version = "test";
  }
  ActionSetReport Make(const StagedProgress& progress = {}) {
    static const ActionStarts starts = FindActionStarts("", {}, *BodyModel::Default(), 1, 1);
    return MakeActionSet(BodyModel::Default(), starts, folder_.Path(), options_, progress);
  }

  testing::TemporaryFolder folder_;
  ActionSetOptions options_;
};

TEST_F(MakeActionSetTest, MakesClipsAndGoesOnWithThem) {
  int told = 0;
  const ActionSetReport first = Make([&](const char* stage, int done, int total) {
    EXPECT_STREQ(stage, "clips");
    EXPECT_EQ(total, 1);
    told = done;
    return true;
  });
  ASSERT_TRUE(first.complete);
  EXPECT_EQ(told, 1);
  EXPECT_EQ(first.made, 1);
  EXPECT_EQ(
      first.head["summary"]["clips"].get<int>() + first.head["summary"]["given_up"].get<int>(), 1);
  EXPECT_TRUE(exists(folder_ / "grasps"));
  const ActionSetReport again = Make();
  EXPECT_EQ(again.had, 1);
  EXPECT_EQ(again.made, 0);
  EXPECT_EQ(again.head, first.head);
  options_.version = "other";
  EXPECT_THROW(Make(), Error);
}

TEST_F(MakeActionSetTest, StopsWhenAskedTo) {
  const ActionSetReport report = Make([](const char*, int, int) { return false; });
  EXPECT_FALSE(report.complete);
  EXPECT_EQ(report.made, 0);
  EXPECT_FALSE(exists(folder_ / "manifest.json"));
}

}  // namespace
}  // namespace holdfast
