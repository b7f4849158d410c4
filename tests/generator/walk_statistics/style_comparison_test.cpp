// SPDX-License-Identifier: MIT
#include "generator/walk_statistics/style_comparison.h"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "generator/nn/random_stream.h"

namespace holdfast {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::vector<double> Normals(int count, double mean, double deviation, std::uint64_t seed) {
  RandomDraws draws(seed);
  std::vector<double> values;
  for (int i = 0; i < count; ++i) values.push_back(mean + deviation * draws.Normal());
  return values;
}

MotionStyle Motion(double way_m, StyleMeasure measure, double value) {
  MotionStyle motion;
  motion.values.fill(kNone);
  motion.way_m = way_m;
  motion.values[static_cast<std::size_t>(measure)] = value;
  return motion;
}

TEST(StyleSpread, OfNumbersAlone) {
  const StyleSpread spread = SpreadOf(std::vector<double>{4.0, kNone, 2.0, 6.0});
  EXPECT_EQ(spread.count, 3);
  EXPECT_DOUBLE_EQ(spread.mean, 4.0);
  EXPECT_DOUBLE_EQ(spread.deviation, 2.0);
  EXPECT_DOUBLE_EQ(spread.standard_error, 2.0 / std::sqrt(3.0));
  EXPECT_DOUBLE_EQ(spread.low, 3.0);
  EXPECT_DOUBLE_EQ(spread.median, 4.0);
  EXPECT_EQ(SpreadOf(std::vector<double>{kNone}).count, 0);
  const StyleSpread one = SpreadOf(std::vector<double>{7.0});
  EXPECT_DOUBLE_EQ(one.mean, 7.0);
  EXPECT_TRUE(std::isnan(one.deviation));
}

TEST(WassersteinDistance, IsTheMeanWayToGo) {
  EXPECT_DOUBLE_EQ(WassersteinDistance(std::vector{0.0, 1.0}, std::vector{3.0, 2.0}), 2.0);
  EXPECT_DOUBLE_EQ(WassersteinDistance(std::vector{0.0}, std::vector{0.0, 1.0}), 0.5);
  EXPECT_DOUBLE_EQ(WassersteinDistance(std::vector{0.0, 10.0}, std::vector{5.0}), 5.0);
  EXPECT_DOUBLE_EQ(WassersteinDistance(std::vector{1.0, 1.0, 2.0}, std::vector{1.0, 2.0, 1.0}),
                   0.0);
  EXPECT_DOUBLE_EQ(WassersteinDistance(std::vector{0.0, kNone}, std::vector{2.0}), 2.0);
  EXPECT_TRUE(std::isnan(WassersteinDistance(std::vector{kNone}, std::vector{2.0})));
}

TEST(StyleDistance, TellsAShiftFromChance) {
  const std::vector<double> reference = Normals(40, 5.0, 2.0, 1);
  const StyleDistance same = DistanceOf(reference, Normals(60, 5.0, 2.0, 2), 0.01, 9);
  EXPECT_FALSE(same.Shown());
  EXPECT_GT(same.by_chance, 0.1);
  const StyleDistance shifted = DistanceOf(reference, Normals(60, 9.0, 2.0, 3), 0.01, 9);
  EXPECT_TRUE(shifted.Shown());
  EXPECT_NEAR(shifted.distance, 2.0, 0.4);
  EXPECT_NEAR(shifted.cohens_d, 2.0, 0.4);
  EXPECT_NEAR(shifted.ratio, 9.0 / 5.0, 0.2);
  // As wide again about the same mean: what means alone do not show.
  const StyleDistance wide = DistanceOf(reference, Normals(60, 5.0, 8.0, 4), 0.01, 9);
  EXPECT_TRUE(wide.Shown());
  EXPECT_LT(std::abs(wide.cohens_d), 0.5);
  // The same seed, the same deals.
  EXPECT_EQ(DistanceOf(reference, reference, 0.01, 9).by_chance,
            DistanceOf(reference, reference, 0.01, 9).by_chance);
  EXPECT_EQ(DistanceOf(reference, reference, 0.01, 9).distance, 0.0);
}

TEST(StyleDistance, ChanceIsRarelyExceededBySetsAlike) {
  int shown = 0;
  for (std::uint64_t i = 0; i < 200; ++i) {
    shown += DistanceOf(Normals(25, 0.0, 1.0, 2 * i + 100), Normals(35, 0.0, 1.0, 2 * i + 101),
                        0.001, i, 200)
                 .Shown();
  }
  EXPECT_GE(shown, 2);  // of 200, 10 are expected
  EXPECT_LE(shown, 20);
}

TEST(StyleDistance, CountsInWhatAnEyeCanTell) {
  // All of the reference alike: the resolution stands for its deviation.
  const std::vector<double> reference(10, 0.0), other(10, 0.03);
  const StyleDistance distance = DistanceOf(reference, other, 0.02, 1);
  EXPECT_DOUBLE_EQ(distance.distance, 1.5);
  EXPECT_DOUBLE_EQ(distance.cohens_d, 1.5);
  EXPECT_TRUE(distance.Shown());
  EXPECT_TRUE(std::isnan(distance.ratio));
  const StyleDistance none = DistanceOf(reference, std::vector<double>{kNone}, 0.02, 1);
  EXPECT_TRUE(std::isnan(none.distance));
  EXPECT_FALSE(none.Shown());
}

TEST(StyleSet, MeasuresOfWalksAskWalks) {
  const StyleSet set{
      "set",
      {Motion(3.0, StyleMeasure::kStepLength, 0.6), Motion(0.4, StyleMeasure::kStepLength, 0.1),
       Motion(0.4, StyleMeasure::kAirborne, 0.2), Motion(3.0, StyleMeasure::kAirborne, kNone)},
      1.0};
  EXPECT_THAT(ValuesOf(set, StyleMeasure::kStepLength), ::testing::ElementsAre(0.6));
  EXPECT_THAT(ValuesOf(set, StyleMeasure::kAirborne), ::testing::ElementsAre(0.2));
  StyleSet all = set;
  all.least_way_m = 0.0;
  EXPECT_THAT(ValuesOf(all, StyleMeasure::kStepLength), ::testing::ElementsAre(0.6, 0.1));
}

TEST(StyleSet, CurvesAreSpreadPointByPoint) {
  StyleSet set{"set", {}, 1.0};
  for (const double height : {1.0, 2.0, 6.0}) {
    MotionStyle motion = Motion(2.0, StyleMeasure::kLean, 0.0);
    motion.curves[static_cast<std::size_t>(StyleCurve::kPower)] =
        Eigen::Vector2d(height, 10.0 * height);
    set.motions.push_back(motion);
  }
  set.motions.push_back(Motion(2.0, StyleMeasure::kLean, 0.0));  // has no such curve
  const StyleCurveSpread spread = SpreadOf(set, StyleCurve::kPower);
  EXPECT_EQ(spread.count, 3);
  EXPECT_DOUBLE_EQ(spread.mean[0], 3.0);
  EXPECT_DOUBLE_EQ(spread.median[1], 20.0);
  EXPECT_DOUBLE_EQ(spread.high[0], 4.0);
  EXPECT_EQ(SpreadOf(set, StyleCurve::kLeans).count, 0);
}

TEST(Oddness, NamesTheMeasureThatIsFarthestOff) {
  std::array<StyleSpread, kNumStyleMeasures> reference = {};
  const auto spread = [&](StyleMeasure measure) -> StyleSpread& {
    return reference[static_cast<std::size_t>(measure)];
  };
  spread(StyleMeasure::kLean) = SpreadOf(std::vector<double>{0.0, 10.0, 20.0});        // 10 +- 10
  spread(StyleMeasure::kAcceleration) = SpreadOf(std::vector<double>{1.0, 3.0, 5.0});  // 3 +- 2
  MotionStyle motion = Motion(2.0, StyleMeasure::kLean, 20.0);                         // 1 off
  motion.values[static_cast<std::size_t>(StyleMeasure::kAcceleration)] = 63.0;         // 30 off
  const Oddness odd = OddnessOf(motion, StyleSet{"set", {}, 1.0}, reference);
  EXPECT_EQ(odd.most, StyleMeasure::kAcceleration);
  EXPECT_DOUBLE_EQ(odd.most_off, 30.0);
  EXPECT_DOUBLE_EQ(odd.value, 3.0);  // of 1 and at most 5
}

}  // namespace
}  // namespace holdfast
