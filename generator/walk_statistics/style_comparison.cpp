// SPDX-License-Identifier: MIT
#include "generator/walk_statistics/style_comparison.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "generator/nn/random_stream.h"
#include "generator/walk_statistics/sample_statistics.h"

namespace holdfast {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

std::vector<double> SortedNumbers(std::span<const double> values) {
  std::vector<double> numbers;
  for (const double value : values) {
    if (std::isfinite(value)) numbers.push_back(value);
  }
  std::ranges::sort(numbers);
  return numbers;
}

// The area between the two distribution functions.
double WassersteinOfSorted(const std::vector<double>& a, const std::vector<double>& b) {
  double distance = 0.0, before = 0.0;
  std::size_t i = 0, j = 0;
  while (i < a.size() || j < b.size()) {
    const double here = j == b.size() || (i < a.size() && a[i] <= b[j]) ? a[i] : b[j];
    if (i + j > 0) {
      const double below_a = static_cast<double>(i) / static_cast<double>(a.size());
      const double below_b = static_cast<double>(j) / static_cast<double>(b.size());
      distance += std::abs(below_a - below_b) * (here - before);
    }
    while (i < a.size() && a[i] == here) ++i;
    while (j < b.size() && b[j] == here) ++j;
    before = here;
  }
  return distance;
}

bool OfWalks(StyleCurve curve) {
  return curve != StyleCurve::kSpeeds && curve != StyleCurve::kLeans &&
         curve != StyleCurve::kHandSpeed;
}

}  // namespace

StyleSpread SpreadOf(std::span<const double> values) {
  const std::vector<double> sorted = SortedNumbers(values);
  StyleSpread spread{
      static_cast<int>(sorted.size()), kUnknown, kUnknown, kUnknown, kUnknown, kUnknown, kUnknown};
  if (sorted.empty()) return spread;
  const double count = spread.count;
  spread.mean = MeanOf(sorted);
  spread.low = QuantileOfSorted(sorted, 0.25);
  spread.median = QuantileOfSorted(sorted, 0.5);
  spread.high = QuantileOfSorted(sorted, 0.75);
  if (spread.count < 2) return spread;
  double squares = 0.0;
  for (const double value : sorted) squares += (value - spread.mean) * (value - spread.mean);
  spread.deviation = std::sqrt(squares / (count - 1.0));
  spread.standard_error = spread.deviation / std::sqrt(count);
  return spread;
}

double WassersteinDistance(std::span<const double> a, std::span<const double> b) {
  const std::vector<double> of_a = SortedNumbers(a), of_b = SortedNumbers(b);
  return of_a.empty() || of_b.empty() ? kUnknown : WassersteinOfSorted(of_a, of_b);
}

StyleDistance DistanceOf(std::span<const double> reference, std::span<const double> other,
                         double resolution, std::uint64_t seed, int deals) {
  const std::vector<double> a = SortedNumbers(reference), b = SortedNumbers(other);
  if (a.empty() || b.empty()) return {kUnknown, kUnknown, kUnknown, kUnknown};
  const StyleSpread of_a = SpreadOf(a), of_b = SpreadOf(b);
  const auto at_least = [&](double deviation) {
    return std::isfinite(deviation) ? std::max(deviation, resolution) : resolution;
  };
  const double spread = at_least(of_a.deviation);
  StyleDistance result;
  result.ratio = of_a.mean != 0.0 ? of_b.mean / of_a.mean : kUnknown;
  const auto squares = [](const StyleSpread& s) {
    return s.count > 1 ? s.deviation * s.deviation * (s.count - 1) : 0.0;
  };
  const double freedom = std::max(of_a.count + of_b.count - 2, 1);
  const double pooled = at_least(std::sqrt((squares(of_a) + squares(of_b)) / freedom));
  result.cohens_d = (of_b.mean - of_a.mean) / pooled;
  result.distance = WassersteinOfSorted(a, b) / spread;

  // Deal all motions anew, as many to each set as before; in their order, nothing is to be sorted.
  std::vector<double> all = a;
  all.insert(all.end(), b.begin(), b.end());
  std::ranges::sort(all);
  RandomDraws draws(seed);
  std::vector<double> distances;
  for (int deal = 0; deal < deals; ++deal) {
    int of_first = 0, left = of_a.count;
    double distance = 0.0;
    for (std::size_t i = 0; i + 1 < all.size(); ++i) {
      const int dealt = static_cast<int>(i);
      const int remaining = of_a.count + of_b.count - dealt;
      if (draws.Index(remaining) < left) {
        --left;
        ++of_first;
      }
      const double below_a = static_cast<double>(of_first) / of_a.count;
      const double below_b = static_cast<double>(dealt + 1 - of_first) / of_b.count;
      distance += std::abs(below_a - below_b) * (all[i + 1] - all[i]);
    }
    distances.push_back(distance / spread);
  }
  std::ranges::sort(distances);
  result.by_chance = distances.empty() ? 0.0 : QuantileOfSorted(distances, 0.95);
  return result;
}

bool Asked(const StyleSet& set, const MotionStyle& motion, StyleMeasure measure) {
  return !StyleMeasures()[static_cast<std::size_t>(measure)].of_walks ||
         motion.way_m >= set.least_way_m;
}

std::vector<double> ValuesOf(const StyleSet& set, StyleMeasure measure) {
  std::vector<double> values;
  for (const MotionStyle& motion : set.motions) {
    if (Asked(set, motion, measure) && std::isfinite(motion[measure])) {
      values.push_back(motion[measure]);
    }
  }
  return values;
}

StyleCurveSpread SpreadOf(const StyleSet& set, StyleCurve curve) {
  std::vector<const Eigen::VectorXd*> curves;
  for (const MotionStyle& motion : set.motions) {
    if (motion[curve].size() == 0) continue;
    if (!OfWalks(curve) || motion.way_m >= set.least_way_m) curves.push_back(&motion[curve]);
  }
  StyleCurveSpread spread;
  spread.count = static_cast<int>(curves.size());
  if (curves.empty()) return spread;
  const Eigen::Index points = curves[0]->size();
  for (auto* part : {&spread.mean, &spread.low, &spread.median, &spread.high}) part->resize(points);
  std::vector<double> values(curves.size());
  for (Eigen::Index i = 0; i < points; ++i) {
    for (std::size_t k = 0; k < curves.size(); ++k) values[k] = (*curves[k])[i];
    const StyleSpread at = SpreadOf(values);
    spread.mean[i] = at.mean;
    spread.low[i] = at.low;
    spread.median[i] = at.median;
    spread.high[i] = at.high;
  }
  return spread;
}

Oddness OddnessOf(const MotionStyle& motion, const StyleSet& set,
                  const std::array<StyleSpread, kNumStyleMeasures>& reference) {
  constexpr double kMost = 5.0;
  Oddness oddness;
  int count = 0;
  for (int m = 0; m < kNumBodyMeasures; ++m) {
    const auto measure = static_cast<StyleMeasure>(m);
    const StyleSpread& spread = reference[static_cast<std::size_t>(m)];
    const double value = motion[measure];
    if (!std::isfinite(value) || spread.count == 0 || !Asked(set, motion, measure)) continue;
    const double resolution = StyleMeasures()[static_cast<std::size_t>(m)].resolution;
    const double deviation =
        std::isfinite(spread.deviation) ? std::max(spread.deviation, resolution) : resolution;
    const double off = std::abs(value - spread.mean) / deviation;
    oddness.value += std::min(off, kMost);
    ++count;
    if (off > oddness.most_off || oddness.most == StyleMeasure::kCount) {
      oddness.most = measure;
      oddness.most_value = value;
      oddness.most_off = off;
    }
  }
  oddness.value = count > 0 ? oddness.value / count : kUnknown;
  return oddness;
}

}  // namespace holdfast
