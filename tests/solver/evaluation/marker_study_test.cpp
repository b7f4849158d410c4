// SPDX-License-Identifier: MIT
#include "solver/evaluation/marker_study.h"

#include <cmath>

#include <gtest/gtest.h>

namespace holdfast {
namespace {

MarkerTrialResult Trial(const std::string& name, double residual_mm, int frames, double core_s) {
  MarkerTrialResult result;
  result.name = name;
  result.frames = frames;
  result.rate_hz = 100.0;
  result.core_s = core_s;
  result.residual = {.square_sum_mm2 = residual_mm * residual_mm * frames, .count = frames};
  result.change = {.square_sum_mm2 = 400.0 / residual_mm, .count = 100};
  result.left_out.push_back({"RFTP", {.square_sum_mm2 = 9.0 * frames, .count = frames}});
  return result;
}

TEST(SumsOfMarkerStudy, AreOfAllTrialsThatWereSolved) {
  MarkerTrialResult failed;
  failed.name = "c";
  failed.fault = "no marker's name is known";
  const std::vector<MarkerTrialResult> results = {Trial("a", 1.0, 300, 1.0), failed,
                                                  Trial("b", 3.0, 100, 2.0)};
  const MarkerStudySums sums = SumsOf(results);
  EXPECT_EQ(sums.solved, 2);
  EXPECT_NEAR(sums.residual.Rms_mm(), std::sqrt((300.0 + 900.0) / 400.0), 1e-12);
  EXPECT_NEAR(sums.left_out.Rms_mm(), 3.0, 1e-12);
  EXPECT_EQ(sums.of_left_out.at("RFTP").count, 400);
  EXPECT_EQ(results[*sums.worst].name, "b");
  EXPECT_EQ(results[*sums.worst_change].name, "a");
  EXPECT_EQ(results[*sums.slowest].name, "b");
  EXPECT_NEAR(sums.seconds, 4.0, 1e-12);
  EXPECT_NEAR(sums.core_s, 3.0, 1e-12);
  const MarkerStudySums none = SumsOf({failed});
  EXPECT_EQ(none.solved, 0);
  EXPECT_FALSE(none.worst || none.worst_change || none.slowest);
}

}  // namespace
}  // namespace holdfast
