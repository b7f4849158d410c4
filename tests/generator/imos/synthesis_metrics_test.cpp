// SPDX-License-Identifier: MIT
#include "generator/imos/synthesis_metrics.h"

#include <cmath>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "generator/imos/synthesis_metrics_motion.h"
#include "geometry/error.h"

// Expected numbers with many digits are of NumPy and SciPy (cov, linalg.sqrtm, spatial.distance)
// on the same formulas.

namespace holdfast::imos {
namespace {

JointMotion SwayingJoints(int which, int frames = 15) {
  return JointMotion::NullaryExpr(66, frames, [&](Eigen::Index r, Eigen::Index t) {
    const auto row = static_cast<double>(r), frame = static_cast<double>(t);
    return 0.8 * std::sin(0.31 * row + 0.17 * which) +
           0.05 * std::sin(0.4 * frame + 0.9 * row + 1.3 * which);
  });
}

Eigen::MatrixXf WavyFeatures(int which, int count) {
  return Eigen::MatrixXf::NullaryExpr(128, count, [&](Eigen::Index row, Eigen::Index column) {
    const auto i = static_cast<double>(row), n = static_cast<double>(column);
    return static_cast<float>(0.1 * std::sin(0.37 * (i + 1) * (n + 1) + 0.05 * which * i) *
                              std::cos(0.2 * which * n + 0.01 * i));
  });
}

std::vector<int> SquaresModulo7(int count) {
  std::vector<int> labels;
  for (int n = 0; n < count; ++n) labels.push_back(n * n % 7);
  return labels;
}

TEST(MotionError, IsNothingForTheSameMotion) {
  const JointMotion motion = SwayingJoints(0);
  EXPECT_EQ(MeanJointError(motion, motion), 0.0);
  EXPECT_EQ(AverageVarianceErrorOfCode(motion, motion), 0.0);
  EXPECT_EQ(AverageVarianceError(motion, motion), 0.0);
}

TEST(MotionError, IsThatOfNumPy) {
  const JointMotion a = SwayingJoints(0), b = SwayingJoints(1);
  EXPECT_NEAR(MeanJointError(a, b), 0.167655245333, 1e-12);
  EXPECT_NEAR(AverageVarianceErrorOfCode(a, b), 46.870324978543, 1e-10);
  EXPECT_NEAR(AverageVarianceError(a, b), 0.00023232056196, 1e-14);
}

// Why both are given: where a motion is should not matter to how much it varies.
TEST(MotionError, OfTheCodeGrowsWithThePlaceAndTheStandardOneDoesNot) {
  const JointMotion a = SwayingJoints(0), b = SwayingJoints(1);
  const JointMotion a_away = a.array() + 2.0, b_away = b.array() + 2.0;
  EXPECT_NEAR(AverageVarianceError(a_away, b_away), AverageVarianceError(a, b), 1e-13);
  EXPECT_GT(AverageVarianceErrorOfCode(a_away, b_away), 2.0 * AverageVarianceErrorOfCode(a, b));
}

TEST(MotionError, RefusesWhatCannotBeCompared) {
  const JointMotion motion = SwayingJoints(0);
  EXPECT_THROW(MeanJointError(motion, SwayingJoints(0, 14)), Error);
  EXPECT_THROW(MeanJointError(motion.topRows(63), motion.topRows(63)), Error);
  EXPECT_THROW(AverageVarianceError(motion.leftCols(1), motion.leftCols(1)), Error);
}

TEST(SynthesisMetrics, FrechetDistanceIsThatOfSciPy) {
  EXPECT_NEAR(FrechetDistance(WavyFeatures(0, 160), WavyFeatures(1, 160)), 0.444735131762, 1e-8);
  // Covariances of low rank, sets of unequal sizes.
  EXPECT_NEAR(FrechetDistance(WavyFeatures(0, 5), WavyFeatures(1, 7)), 0.667448652331, 1e-6);
}

TEST(SynthesisMetrics, FrechetDistanceOfSetsThatOnlyMovedIsTheWaySquared) {
  const Eigen::MatrixXf features = WavyFeatures(0, 40);
  Eigen::VectorXf way = Eigen::VectorXf::LinSpaced(128, -0.02f, 0.03f);
  EXPECT_NEAR(FrechetDistance(features.colwise() + way, features), way.squaredNorm(), 1e-6);
  EXPECT_NEAR(FrechetDistance(features, features), 0.0, 1e-7);
}

// By hand: in one dimension (m - m')^2 + (s - s')^2.
TEST(SynthesisMetrics, FrechetDistanceOfOneNumberIsByHand) {
  Eigen::MatrixXf a(1, 3), b(1, 3);
  a << 0.0f, 1.0f, 2.0f;  // mean 1, deviation 1
  b << 2.0f, 5.0f, 8.0f;  // mean 5, deviation 3
  EXPECT_NEAR(FrechetDistance(a, b), 16.0 + 4.0, 1e-12);
}

TEST(SynthesisMetrics, FrechetDistanceOfTheCodeIsOfPairs) {
  const Eigen::MatrixXf features = WavyFeatures(0, 160), reference = WavyFeatures(1, 160);
  EXPECT_NEAR(FrechetDistanceOfCode(features, reference), 0.712107146930, 1e-9);
  // The same set in another order is no distance of distributions, yet it is one of pairs.
  const Eigen::MatrixXf reversed = features.rowwise().reverse();
  EXPECT_NEAR(FrechetDistance(reversed, features), 0.0, 1e-7);
  EXPECT_GT(FrechetDistanceOfCode(reversed, features), 0.5);
  EXPECT_THROW(FrechetDistanceOfCode(features, reference.leftCols(100)), Error);
}

TEST(SynthesisMetrics, AccuracyCountsWhatAgrees) {
  EXPECT_DOUBLE_EQ(RecognitionAccuracy(std::vector{3, 1, 4, 1}, std::vector{3, 1, 4, 2}), 0.75);
  EXPECT_THROW(RecognitionAccuracy(std::vector{3}, std::vector{3, 1}), Error);
}

TEST(SynthesisMetrics, DiversityIsThatOfSciPyAndTheDrawnOneComesNear) {
  const Eigen::MatrixXf features = WavyFeatures(0, 160);
  const double all = Diversity(features);
  EXPECT_NEAR(all, 0.870566000579, 1e-8);
  double mean = 0.0;
  for (std::uint64_t seed = 0; seed < 50; ++seed) mean += DiversityOfCode(features, seed) / 50.0;
  // A motion is paired with itself once in 160 draws.
  EXPECT_NEAR(mean, all * 159.0 / 160.0, 0.005);
  EXPECT_EQ(DiversityOfCode(features, 3), DiversityOfCode(features, 3));
  EXPECT_THROW(Diversity(features.leftCols(1)), Error);
}

TEST(SynthesisMetrics, MultimodalityIsThatOfSciPy) {
  EXPECT_NEAR(*Multimodality(WavyFeatures(0, 160), SquaresModulo7(160)), 0.880596090438, 1e-8);
  EXPECT_FALSE(Multimodality(WavyFeatures(0, 3), std::vector{0, 1, 2}).has_value());
}

// Four of the 29 labels occur, each often enough for its 20 pairs: the sum is over all 29.
TEST(SynthesisMetrics, MultimodalityOfTheCodeCountsLabelsThatNeverOccurAsZero) {
  const Eigen::MatrixXf features = WavyFeatures(0, 160);
  const std::vector<int> labels = SquaresModulo7(160);
  const double seen = *Multimodality(features, labels);
  double mean = 0.0;
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    mean += MultimodalityOfCode(features, labels, 29, seed) / 50.0;
  }
  // Pairs with itself: once in 23 to 46 draws.
  EXPECT_NEAR(mean, seen * 4.0 / 29.0 * (1.0 - 1.0 / 36.0), 0.002);
  EXPECT_NEAR(MultimodalityOfCode(features, labels, 5, 7),
              MultimodalityOfCode(features, labels, 29, 7) * 29.0 / 5.0, 1e-12);
}

TEST(SynthesisMetrics, IntervalsAreNormalOnes) {
  const RepeatedValue value = OverRepeats(std::vector{1.0, 2.0, 3.0, 4.0});
  EXPECT_DOUBLE_EQ(value.mean, 2.5);
  EXPECT_NEAR(value.interval, 1.96 * std::sqrt(5.0 / 3.0) / 2.0, 1e-12);
  EXPECT_EQ(value.repeats, 4);
  EXPECT_EQ(OverRepeats(std::vector{7.0}).interval, 0.0);
}

}  // namespace
}  // namespace holdfast::imos
