// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "geometry/body/body_model.h"
#include "geometry/conventions/loose_motion.h"

namespace holdfast {

/// Whether finger poses are full rotations or differences from a model's mean hand (the smplx
/// package's flat_hand_mean = True and False), judged by what relaxed fingers look like: near the
/// mean in full rotations, near zero in differences.
struct HandMeanEvidence {
  enum class Reading { kFull, kRelative, kUndecided, kZero, kAbsent };
  Reading reading = Reading::kAbsent;
  bool certain = false;
  /// How near the fingers come to zero and to the model's mean hand, in units of that hand's own
  /// size: of the hand and frame nearest to either.
  double from_zero = 0;
  double from_mean = 0;
  bool moves = false;  ///< whether any finger moves in the clip
};

HandMeanEvidence JudgeHandMean(const LooseMotion& motion, const BodyModel& body);

/// How the object's rotation is meant, and which hand carries it, judged by what stays put in the
/// frame of a wrist.
struct ObjectEvidence {
  enum class Convention { kColumn, kRow, kUndecided };
  Convention convention = Convention::kUndecided;
  /// Mean turn of the object against the carrying wrist in a fifth of a second under either
  /// reading, radians, and in how many steps it was measured.
  double column_drift_rad = 0;
  double row_drift_rad = 0;
  int steps = 0;

  std::optional<Side> holder;   ///< the hand that the object moves along with
  double holder_share = 0;      ///< of the steps in which the object moves
  double wrist_distance_m = 0;  ///< median from the holder's (or the nearer) wrist to the object
  bool moves = false;           ///< whether the object moves at all
};

ObjectEvidence JudgeObject(const LooseMotion& motion, const BodyModel& body,
                           double meters_per_unit);

}  // namespace holdfast
