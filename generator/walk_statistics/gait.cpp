// SPDX-License-Identifier: MIT
#include "generator/walk_statistics/gait.h"

#include <algorithm>
#include <limits>

namespace holdfast {
namespace {

struct Run {
  int begin, end;
};

// Frames in a row that have any of `bits`.
std::vector<Run> RunsOf(std::span<const SoleBits> contacts, SoleBits bits) {
  std::vector<Run> runs;
  const int frames = static_cast<int>(contacts.size());
  for (int t = 0; t < frames; ++t) {
    if ((contacts[t] & bits) == 0) continue;
    const int begin = t;
    while (t < frames && (contacts[t] & bits) != 0) ++t;
    runs.push_back({begin, t});
  }
  return runs;
}

}  // namespace

std::vector<Stance> FindStances(std::span<const SoleBits> contacts, std::span<const Soles> soles) {
  std::vector<Stance> stances;
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const int heel = side == Side::kLeft ? 0 : 2;
    for (const Run& run : RunsOf(contacts, side == Side::kLeft ? kLeftSole : kRightSole)) {
      const Soles& halfway = soles[(run.begin + run.end - 1) / 2];
      stances.push_back(
          {side, run.begin, run.end, 0.5 * (halfway.col(heel) + halfway.col(heel + 1)).head<2>()});
    }
  }
  return stances;
}

std::vector<Stride> FindStrides(std::span<const Stance> stances, std::span<const Soles> soles,
                                double frame_rate, double shortest_m) {
  std::vector<Stride> strides;
  for (std::size_t i = 0; i + 1 < stances.size(); ++i) {
    const Stance &from = stances[i], &to = stances[i + 1];
    if (from.side != to.side) continue;
    Stride stride{from.side, from.end, to.begin, (to.place - from.place).norm(), 0.0, 0.0};
    if (stride.length_m < shortest_m) continue;
    const int heel = stride.side == Side::kLeft ? 0 : 2;
    for (int t = stride.lift_off; t < stride.touch_down; ++t) {
      stride.height_m = std::max(stride.height_m, soles[t].block<1, 2>(2, heel).maxCoeff());
    }
    stride.duration_s = from.begin > 0 ? (to.begin - from.begin) / frame_rate
                                       : std::numeric_limits<double>::quiet_NaN();
    strides.push_back(stride);
  }
  return strides;
}

std::vector<double> ContactDrifts(std::span<const SoleBits> contacts,
                                  std::span<const Soles> soles) {
  std::vector<double> drifts;
  for (int i = 0; i < GroundProbe::kNumSoles; ++i) {
    for (const Run& run : RunsOf(contacts, static_cast<SoleBits>(1u << i))) {
      const Eigen::Vector2d began = soles[run.begin].col(i).head<2>();
      double farthest = 0.0;
      for (int t = run.begin; t < run.end; ++t) {
        farthest = std::max(farthest, (soles[t].col(i).head<2>() - began).norm());
      }
      drifts.push_back(farthest);
    }
  }
  return drifts;
}

}  // namespace holdfast
