// SPDX-License-Identifier: MIT
#include "solver/evaluation/pass_study.h"

#include <array>

#include <gtest/gtest.h>

#include "geometry/import/load_clip.h"

namespace holdfast {
namespace {

TEST(TryPass, LeadsTheFreeHandsPastAWineglassNoFasterThanTheClip) {
  const LoadedClip motion = LoadClip("demo_pass");
  CarryOptions options;
  options.threads = 2;
  const std::optional<PassRow> row =
      TryPass(motion.clip, motion.body, PrepareObject(LoadObject("wineglass")), options);
  ASSERT_TRUE(row);
  ASSERT_EQ(row->fault, "");
  EXPECT_EQ(row->clean, 1);
  EXPECT_LT(row->deepest_mm, 2.0);
  EXPECT_LT(row->carrying_acceleration, 1.1);
  EXPECT_LT(row->free_acceleration, 1.1);
}

TEST(SummarizePasses, TellsTheWorstOfAccelerationsAndDepthsOfRowsWithoutFault) {
  std::array<PassRow, 3> rows;
  rows[0].deepest_mm = 0.5;
  rows[0].free_acceleration = 0.7;
  rows[0].carrying_acceleration = 0.9;
  rows[1] = rows[0];
  rows[1].free_acceleration = 0.8;
  rows[2].fault = "no hand touches";
  const PassRow all = SummarizePasses(rows);
  EXPECT_EQ(all.deepest_mm, 0.5);
  EXPECT_EQ(all.free_acceleration, 0.8);
  EXPECT_EQ(all.carrying_acceleration, 0.9);
}

}  // namespace
}  // namespace holdfast
