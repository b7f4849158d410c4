// SPDX-License-Identifier: MIT
#include "generator/walk_statistics/hand_way.h"

#include <cmath>

#include <gtest/gtest.h>

#include "generator/scripted/minimum_jerk.h"

namespace holdfast {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

constexpr double kRate = 100.0;

// Waits, goes to each of these places by minimum jerk in a second, waits.
Matrix3Xd Through(const std::vector<Vector3d>& places) {
  const int legs = static_cast<int>(places.size()) - 1;
  Matrix3Xd path(3, static_cast<int>(kRate) * (legs + 2));
  for (int t = 0; t < path.cols(); ++t) {
    path.col(t) = places[0];
    for (int k = 0; k < legs; ++k) {
      const double share = MinimumJerk(std::clamp(t / kRate - 1.0 - k, 0.0, 1.0));
      path.col(t) += share * (places[k + 1] - places[k]);
    }
  }
  return path;
}

TEST(HandWay, OfMinimumJerkIsKnown) {
  const HandWay way = MeasureHandWay(Through({{0, 0, 1}, {0.2, -0.1, 1.4}}), kRate, 40);
  const double distance = Vector3d(0.2, -0.1, 0.4).norm();
  EXPECT_NEAR(way.peak_m_s, 1.875 * distance, 0.002);  // at half time: 15/8 of the mean
  EXPECT_NEAR(way.straightness_ratio, 1.0, 1e-9);
  EXPECT_EQ(way.submovements, 1.0);
  // Speed is a tenth of its greatest, 16 s^2 (1 - s)^2, at s = 0.0981; 95 % is made at s = 0.811.
  EXPECT_NEAR(way.begin, 109, 1);
  EXPECT_NEAR(way.arrival, 182, 1);
  EXPECT_NEAR(way.time_to_peak_ratio, (0.5 - 0.0981) / (0.811 - 0.0981), 0.02);
  ASSERT_EQ(way.profile.size(), 40);
  EXPECT_NEAR(way.profile.maxCoeff(), 1.0, 0.01);
}

TEST(HandWay, ATakingBeforeItIsNotOfIt) {
  // To a cup that is near, then to the mouth, back to the cup and to the start: faster.
  const Vector3d start(0, 0, 1), cup(0.02, -0.1, 1), mouth(0.1, -0.15, 1.4);
  Matrix3Xd path = Through({start, cup, mouth, mouth, cup, start});
  const HandWay way = MeasureHandWay(path, kRate, 40);
  EXPECT_GE(way.begin, 200);
  EXPECT_LE(way.arrival, 300);
  EXPECT_NEAR(way.length_m, 0.93 * (mouth - cup).norm(), 0.02);
  EXPECT_EQ(way.submovements, 1.0);
}

TEST(HandWay, ADetourIsLongerAndAHaltAMovementMore) {
  const HandWay bent = MeasureHandWay(Through({{0, 0, 1}, {0.3, 0, 1}, {0.3, 0.3, 1}}), kRate, 40);
  EXPECT_LT(bent.straightness_ratio, 0.9);
  Matrix3Xd path = Through({{0, 0, 1}, {0.4, 0, 1}});
  for (int t = 0; t < path.cols(); ++t) {
    const double s = std::clamp(t / kRate - 1.0, 0.0, 1.0);
    path(0, t) += 0.025 * std::sin(6.0 * M_PI * s);  // slower and faster by turns
  }
  EXPECT_GE(MeasureHandWay(path, kRate, 40).submovements, 2.0);
}

TEST(HandWay, WhoHardlyMovesHasNone) {
  EXPECT_TRUE(std::isnan(MeasureHandWay(Through({{0, 0, 1}, {0.03, 0, 1}}), kRate, 4).seconds));
  EXPECT_TRUE(std::isnan(MeasureHandWay(Matrix3Xd::Zero(3, 2), kRate, 4).peak_m_s));
  EXPECT_TRUE(std::isnan(MeasureHandWay(Matrix3Xd::Zero(3, 0), kRate, 4).peak_m_s));
}

}  // namespace
}  // namespace holdfast
