// SPDX-License-Identifier: MIT
#include "solver/handover/handover_search.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "generator/scripted/minimum_jerk.h"

namespace holdfast {
namespace {

// Hands that come together until `begin` in 0.6 s, and part from `end` on in 1.1 s: slowly.
Eigen::Matrix3Xd Hands(double begin, double end, double frame_rate) {
  Eigen::Matrix3Xd between(3, 90);
  for (int t = 0; t < 90; ++t) {
    between.col(t) =
        Eigen::Vector3d(0.08, 0.0, 0.02) +
        MinimumJerk((begin - t) / (0.6 * frame_rate)) * Eigen::Vector3d(0.3, -0.1, -0.2) +
        MinimumJerk((t - end) / (1.1 * frame_rate)) * Eigen::Vector3d(-0.1, 0.2, 0.0);
  }
  return between;
}

TEST(FitDwell, FindsWhenHandsComeTogetherAndPart) {
  const Dwell dwell = FitDwell(Hands(40.0, 46.5, 30.0), 30.0, {37.0, 52.0});
  EXPECT_NEAR(dwell.begin, 40.0, 0.51);
  EXPECT_NEAR(dwell.end, 46.5, 0.51);
}

TEST(FitDwell, IsWithinAFrameInNoise) {
  Eigen::Matrix3Xd between = Hands(40.0, 46.0, 30.0);
  std::srand(5);
  between += 0.01 * Eigen::Matrix3Xd::Random(3, 90);
  EXPECT_NEAR(FitDwell(between, 30.0, {37.0, 52.0}).Middle(), 43.0, 1.0);
}

TEST(FitDwell, ReturnsTheGuessOfTooFewFrames) {
  const Dwell dwell = FitDwell(Eigen::Matrix3Xd::Zero(3, 6), 30.0, {1.0, 4.0});
  EXPECT_EQ(dwell.begin, 1.0);
  EXPECT_EQ(dwell.end, 4.0);
}

}  // namespace
}  // namespace holdfast
