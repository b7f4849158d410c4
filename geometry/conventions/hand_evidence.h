// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "geometry/body/body_model.h"
#include "geometry/conventions/loose_motion.h"

namespace holdfast {

/// Evidence whether finger poses are full rotations or relative to a model's mean hand (the smplx
/// package's flat_hand_mean = True and False). Relaxed fingers are near the mean in full rotations,
/// and near zero in relative ones.
struct HandMeanEvidence {
  enum class Reading { kFull, kRelative, kUndecided, kZero, kAbsent };
  Reading reading = Reading::kAbsent;
  bool certain = false;
  /// Smallest distance of the fingers from zero and from the model's mean hand, relative to the
  /// norm of the mean: over hands and frames.
  double from_zero = 0;
  double from_mean = 0;
  bool moves = false;  ///< whether any finger moves in the clip
};

HandMeanEvidence JudgeHandMean(const LooseMotion& motion, const BodyModel& body);

/// Evidence for the convention of the object's rotation, and for the hand that holds it, from what
/// is constant in the frame of a wrist.
struct ObjectEvidence {
  enum class Convention { kColumn, kRow, kUndecided };
  Convention convention = Convention::kUndecided;
  /// Mean rotation of the object relative to the holding wrist in a fifth of a second for either
  /// convention, radians, and the number of steps measured.
  double column_drift_rad = 0;
  double row_drift_rad = 0;
  int steps = 0;

  std::optional<Side> holder;   ///< the hand that the object moves with
  double holder_share = 0;      ///< fraction of the steps in which the object moves
  double wrist_distance_m = 0;  ///< median from the holder's (or the nearer) wrist to the object
  bool moves = false;           ///< whether the object moves at all
};

ObjectEvidence JudgeObject(const LooseMotion& motion, const BodyModel& body,
                           double meters_per_unit);

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
