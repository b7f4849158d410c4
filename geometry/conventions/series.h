// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace holdfast {

/// Returns the median (the upper of two); 0 for an empty series.
inline double Median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

/// Whether step k of a series exceeds `least` and is an outlier: more than six times the mean of
/// the smaller half of the two steps before and after it. A leap there and back is two such steps;
/// fast motion that accelerates and decelerates is not a leap.
inline bool IsLeap(std::span<const double> steps, std::size_t k, double least) {
  constexpr double kTimesAround = 6.0;
  if (steps[k] <= least) return false;
  std::vector<double> around;
  for (std::size_t i = k < 2 ? 0 : k - 2; i < std::min(k + 3, steps.size()); ++i) {
    if (i != k) around.push_back(steps[i]);
  }
  if (around.empty()) return false;
  std::ranges::sort(around);
  const std::size_t half = (around.size() + 1) / 2;
  double sum = 0.0;
  for (std::size_t i = 0; i < half; ++i) sum += around[i];
  return steps[k] > kTimesAround * sum / static_cast<double>(half);
}

}  // namespace holdfast
