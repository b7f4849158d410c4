// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "generator/walk_statistics/motion_style.h"

namespace holdfast {

/// Over motions, each counting once; NaN is left out. With `count` 0 all others are NaN, with 1
/// deviation and standard error.
struct StyleSpread {
  int count = 0;
  double mean = 0, standard_error = 0;
  double deviation = 0;                  ///< standard, of the sample
  double low = 0, median = 0, high = 0;  ///< quartiles
};
StyleSpread SpreadOf(std::span<const double> values);

/// 1-Wasserstein distance of two samples: the mean way that values must be moved to make one the
/// other. NaN is left out; NaN when nothing is left of one.
double WassersteinDistance(std::span<const double> a, std::span<const double> b);

/// How far one set is from the reference, by one measure.
struct StyleDistance {
  double ratio = 0;     ///< of the means, other / reference; NaN where the reference's is 0
  double cohens_d = 0;  ///< (mean - reference's) / pooled deviation, at least the resolution
  /// WassersteinDistance over the reference's deviation, at least the measure's resolution.
  double distance = 0;
  /// 95th percentile of what `distance` is when the same motions are dealt to the two sets at
  /// random: below that, nothing is shown.
  double by_chance = 0;

  bool Shown() const { return distance > by_chance; }
};
/// `resolution` as in StyleMeasureInfo. All NaN when either has no value.
StyleDistance DistanceOf(std::span<const double> reference, std::span<const double> other,
                         double resolution, std::uint64_t seed, int deals = 1000);

/// Motions of one origin.
struct StyleSet {
  std::string label;
  std::vector<MotionStyle> motions;
  double least_way_m = 1.0;  ///< measures of walks ask motions that get this far
};

bool Asked(const StyleSet& set, const MotionStyle& motion, StyleMeasure measure);
/// The measure of all motions that are asked, NaN left out.
std::vector<double> ValuesOf(const StyleSet& set, StyleMeasure measure);

/// A curve over all motions that have it; empty when none has. Curves of the way, the heading,
/// power and steps ask walks only.
struct StyleCurveSpread {
  int count = 0;
  Eigen::VectorXd mean, low, median, high;
};
StyleCurveSpread SpreadOf(const StyleSet& set, StyleCurve curve);

/// How unlike the reference one motion is: mean over its measures, but the hand's, of |value -
/// mean| / spread, each at most 5, spread the reference's deviation, at least the resolution.
struct Oddness {
  double value = 0;
  StyleMeasure most = StyleMeasure::kCount;  ///< the measure that is farthest off
  double most_value = 0, most_off = 0;       ///< that measure, and its term before the limit
};
Oddness OddnessOf(const MotionStyle& motion, const StyleSet& set,
                  const std::array<StyleSpread, kNumStyleMeasures>& reference);

}  // namespace holdfast
