// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace holdfast {

/// The median (the upper one of two); 0 of nothing.
inline double Median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

/// Whether step k of a series is more than `least` and stands out from the two steps before and
/// after it: six times the mean of the lesser half of those. A leap there and back is two such
/// steps; fast motion that speeds up and slows down is none.
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
