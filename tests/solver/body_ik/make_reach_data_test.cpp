// SPDX-License-Identifier: MIT
#include "solver/body_ik/make_reach_data.h"

#include <gtest/gtest.h>

#include "geometry/error.h"
#include "tests/support/capture_folder.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

class MakeReachDataTest : public ::testing::Test {
 protected:
  MakeReachDataTest() {
    testing::WriteCaptures(folder_ / "captures");
    set_ = ImportCaptures(folder_ / "captures", folder_ / "captured", *BodyModel::Default(),
                          {"bob"}, 2);
    options_.hours = 0.004;
    options_.version = "test";
  }
  ReachDataReport Make(const StagedProgress& progress = {}) {
    return MakeReachData(*set_, options_, folder_.Path(), progress);
  }

  testing::TemporaryFolder folder_;
  std::optional<CaptureSet> set_;
  ReachDataOptions options_;
};

TEST_F(MakeReachDataTest, MakesWhatIsAskedForAndGoesOn) {
  const ReachDataReport first = Make();
  ASSERT_FALSE(first.stopped);
  EXPECT_GE(first.minutes, 60.0 * options_.hours);
  EXPECT_EQ(first.had, 0);
  EXPECT_TRUE(first.head["complete"]);
  EXPECT_EQ(first.head["summary"]["hours"], first.minutes / 60.0);
  EXPECT_TRUE(exists(folder_ / "made"));
  const ReachDataReport again = Make();
  EXPECT_EQ(again.had, first.tried);
  EXPECT_EQ(again.head, first.head);
  options_.pace = 0.9;
  EXPECT_THROW(Make(), Error);
  options_.replace = true;
  EXPECT_EQ(Make().had, 0);
}

TEST_F(MakeReachDataTest, StopsWhenAskedTo) {
  EXPECT_TRUE(Make([](const char*, int, int) { return false; }).stopped);
  EXPECT_FALSE(exists(folder_ / "manifest.json"));
}

}  // namespace
}  // namespace holdfast
