// SPDX-License-Identifier: MIT
#include "generator/walk_statistics/reach_faults.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "generator/walk_statistics/balance.h"

namespace holdfast {
namespace {

// Mean over up to `radius` frames on either side.
double MeanAround(std::span<const double> values, int t, int radius) {
  const int first = std::max(0, t - radius);
  const int last = std::min(static_cast<int>(values.size()) - 1, t + radius);
  double sum = 0.0;
  for (int s = first; s <= last; ++s) sum += values[static_cast<std::size_t>(s)];
  return sum / (last - first + 1);
}

}  // namespace

int SecondCrouch(std::span<const double> heights) {
  constexpr double kCrouch = 0.12, kChange = 0.06;  // meters
  double stands = -1.0, lowest = 0.0, rises_to = 0.0;
  bool crouched = false, rises = false;
  for (int t = 0; t < static_cast<int>(heights.size()); ++t) {
    const double height = MeanAround(heights, t, 2);
    stands = std::max(stands, height);
    if (height > stands - kChange) {
      crouched = rises = false;  // upright again: what follows is another crouch
    } else if (!crouched) {
      crouched = height < stands - kCrouch;
      lowest = height;
    } else if (!rises) {
      lowest = std::min(lowest, height);
      rises = height > lowest + kChange;
      rises_to = height;
    } else {
      rises_to = std::max(rises_to, height);
      if (height < rises_to - kChange) return t;
    }
  }
  return -1;
}

double LeanBack(const BodyPlacement& placed, double yaw_rad) {
  const Eigen::Vector3d trunk = placed.joints.col(kNeck) - placed.joints.col(kPelvis);
  const Eigen::Vector3d forward(std::sin(yaw_rad), -std::cos(yaw_rad), 0.0);
  return std::atan2(-trunk.dot(forward), trunk.z());
}

ReachFaults FindReachFaults(std::span<const BodyFrame> frames, const BodyMeasures& measures) {
  constexpr int kAround = 10, kKept = 10;  // frames
  constexpr double kRate = 30.0;           // Hz
  const auto count = static_cast<int>(frames.size());
  std::vector<double> heights, leans;
  for (const BodyFrame& frame : frames) {
    const BodyPlacement placed = Place(measures.rest_joints, frame);
    heights.push_back(frame.pelvis.z());
    leans.push_back(LeanBack(placed, Yaw(frame)));
  }
  ReachFaults faults;
  faults.second_crouch = SecondCrouch(heights);
  faults.lean_back_rad = std::numeric_limits<double>::quiet_NaN();
  if (count > 0) {
    const std::size_t end = std::min(frames.size(), static_cast<std::size_t>(kAround) + 1);
    faults.off_balance_m =
        OffBalance(frames.last(end), measures.rest_joints, measures.sole_y, kRate).back();
  }
  const std::vector<bool> still = StandsStill(frames, kRate);
  int waiting = 0;
  for (int t = kAround; t + kAround < count; ++t) {
    waiting = still[static_cast<std::size_t>(t)] ? waiting + 1 : 0;
    if (waiting < kKept) continue;
    const auto last = leans.begin() + t + 1;
    const double kept = *std::min_element(last - kKept, last);
    if (!(kept <= faults.lean_back_rad)) faults.lean_back_rad = kept;
  }
  return faults;
}

}  // namespace holdfast
