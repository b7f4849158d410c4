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

TEST(SumsOfMarkerStudy, OfDrinksAreOfThoseWhoDrink) {
  MarkerTrialResult near = Trial("a", 1.0, 300, 1.0), far = Trial("b", 1.0, 200, 1.0);
  near.drink.emplace().status = GraspStatus::kFound;
  near.drunk.rim_from_mouth_m = 0.010;
  near.head = {.deep_before = 7, .deep = 1, .worst_before_m = 0.02, .worst_m = 0.003};
  far.drink.emplace().status = GraspStatus::kNoCleanGrasp;
  far.drunk.rim_from_mouth_m = 0.030;
  far.in_body_frames = 3;
  const std::vector<MarkerTrialResult> results = {near, Trial("c", 1.0, 100, 1.0), far};
  const DrinkSums drinks = DrinksOf(results);
  EXPECT_EQ(drinks.trials, 2);
  EXPECT_EQ(drinks.at_mouth, 1);
  EXPECT_EQ(drinks.worst, 2u);
  EXPECT_NEAR(drinks.worst_mm, 30.0, 1e-9);
  EXPECT_NEAR(drinks.mean_mm, 20.0, 1e-9);
  EXPECT_EQ(drinks.no_clean_grasp, 1);
  EXPECT_EQ(drinks.in_body_frames, 3);
  const HeadSums heads = HeadsOf(results);
  EXPECT_EQ(heads.frames, 600);
  EXPECT_EQ(heads.deep_before, 7);
  EXPECT_EQ(heads.deep, 1);
  EXPECT_NEAR(heads.worst_before_mm, 20.0, 1e-9);
}

}  // namespace
}  // namespace holdfast
