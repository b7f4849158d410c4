// SPDX-License-Identifier: MIT
#include "solver/body_ik/frame_pose.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace holdfast {

std::vector<double> Envelope(const std::vector<double>& values, int radius) {
  const int count = static_cast<int>(values.size());
  std::vector<double> largest(values), smooth(values.size(), 0.0);
  for (int t = 0; t < count; ++t) {
    for (int s = std::max(0, t - radius); s <= std::min(count - 1, t + radius); ++s) {
      largest[t] = std::max(largest[t], values[s]);
    }
  }
  for (int t = 0; t < count; ++t) {
    double sum = 0.0, weight = 0.0;
    for (int s = std::max(0, t - radius); s <= std::min(count - 1, t + radius); ++s) {
      const double w = 1.0 + std::cos(std::numbers::pi * (s - t) / (radius + 1.0));
      sum += w * largest[s];
      weight += w;
    }
    smooth[t] = sum / weight;
  }
  return smooth;
}

}  // namespace holdfast
