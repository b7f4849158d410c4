// SPDX-License-Identifier: MIT
#include "generator/walk_statistics/way_pace.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <numeric>
#include <vector>

namespace holdfast {
namespace {

constexpr double kSway = 0.1;      // m/s
constexpr double kArrived = 0.95;  // share of the way

// Means over `points` equal parts; a frame that lies partly in one counts there by that part.
Eigen::VectorXd ProfileOf(const std::vector<double>& pace, int points) {
  Eigen::VectorXd profile = Eigen::VectorXd::Zero(points);
  const double width = static_cast<double>(pace.size()) / points;
  for (int i = 0; i < points; ++i) {
    const double begin = i * width, end = begin + width;
    for (auto t = static_cast<std::size_t>(begin); t < pace.size() && static_cast<double>(t) < end;
         ++t) {
      const double from = std::max(begin, static_cast<double>(t));
      const double to = std::min(end, static_cast<double>(t + 1));
      profile[i] += pace[t] * std::max(to - from, 0.0) / width;
    }
  }
  return profile;
}

}  // namespace

WayPace MeasurePace(std::span<const double> speeds, int profile_points) {
  std::vector<double> pace;
  for (const double speed : speeds) pace.push_back(speed >= kSway ? speed : 0.0);
  const double whole = std::accumulate(pace.begin(), pace.end(), 0.0);
  WayPace result;
  result.half_way_ratio = result.fastest_fifth_ratio = std::numeric_limits<double>::quiet_NaN();
  if (whole <= 0.0) return result;

  double made = 0.0;
  std::size_t arrival = 0;
  while (arrival < pace.size() && made < kArrived * whole) made += pace[arrival++];
  pace.resize(arrival);
  result.arrival = static_cast<int>(arrival);
  result.profile = ProfileOf(pace, profile_points);

  const double count = static_cast<double>(arrival);
  double before = 0.0;
  for (std::size_t t = 0; t < arrival; ++t) {
    if (before + pace[t] >= 0.5 * made) {
      const double within = (0.5 * made - before) / pace[t];
      result.half_way_ratio = (static_cast<double>(t) + within) / count;
      break;
    }
    before += pace[t];
  }
  std::ranges::sort(pace, std::greater<>());
  const double fifth = 0.2 * count;
  double fastest = 0.0;
  for (std::size_t t = 0; static_cast<double>(t) < fifth; ++t) {
    fastest += pace[t] * std::min(1.0, fifth - static_cast<double>(t));
  }
  result.fastest_fifth_ratio = fastest / made;
  return result;
}

}  // namespace holdfast
