// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "generator/walk_statistics/motion_set.h"
#include "generator/walk_statistics/style_comparison.h"
#include "geometry/body/body_model.h"

namespace holdfast {

/// A set of motions, measured, and how far it is from the reference.
struct NaturalnessColumn {
  StyleSet set;
  std::vector<std::string> files;  ///< of the motions
  std::array<StyleSpread, kNumStyleMeasures> spread;
  std::array<StyleDistance, kNumStyleMeasures> distance;  ///< NaN for the reference itself
  std::vector<Oddness> oddness;                           ///< of the motions
  double mean_distance = 0;   ///< over measures but the hand's, each at most 5
  double mean_by_chance = 0;  ///< of their `by_chance`
  /// The same over the hand's; NaN where they are not asked for.
  double hand_distance = std::numeric_limits<double>::quiet_NaN();
  double hand_by_chance = std::numeric_limits<double>::quiet_NaN();
  double pair_distance_m = 0;  ///< SetSpread of the motions, of 64 of them where there are more

  int NumMotions() const { return static_cast<int>(set.motions.size()); }
  int NumWalks() const;
  int NumCrouchingTwice() const;  ///< ReachFaults
  int NumLeaningBack() const;
  double Minutes() const;
};

/// What tells a set from the reference, farthest first: measures beyond chance.
std::vector<StyleMeasure> SetApartBy(const NaturalnessColumn& column);
/// Motions least like the reference first.
std::vector<int> OddestMotions(const NaturalnessColumn& column, int count);

struct NaturalnessStudy {
  bool stopped = false;                    ///< by `progress`: all else means nothing
  bool hands = false;                      ///< has the hand's measures
  std::vector<NaturalnessColumn> columns;  ///< reference first
  std::vector<std::string> notes;          ///< what a reader must know about the numbers

  /// Measures and curves that it has: the first of all there are.
  int NumMeasures() const { return hands ? kNumStyleMeasures : kNumBodyMeasures; }
  int NumCurves() const { return hands ? kNumStyleCurves : kNumStyleCurves - 1; }
};

struct NaturalnessOptions {
  std::shared_ptr<const BodyModel> body;  ///< null: the embedded one
  /// Captured motion that joint limits are taken from; notes name it by its label. No files: the
  /// reference.
  MotionSet limits;
  double least_way_m = 1.0;  ///< measures of walks ask motions that get this far
  bool moving_only = false;  ///< and so do all others
  bool hands = false;        ///< the hand's measures too: of who does something
  std::uint64_t seed = 1;
  int threads = 1;  ///< the result does not depend on them
  /// Of all motions, from one thread at a time; false stops the work. `done` is 0 while those are
  /// read that joint limits are taken from.
  std::function<bool(int done, int total)> progress;
};

/// Sets of motions (at least one) by the measures of motion_style.h, the first being what the
/// others are compared with. Motions of any file that LoadClip reads, resampled to 30 Hz, on the
/// ground z = 0, each with the body of who moves. Throws Error, naming the file, for what is no
/// clip of a whole body, and for a set of which no motion gets far enough where that is asked.
NaturalnessStudy CompareNaturalness(const std::vector<MotionSet>& sets,
                                    const NaturalnessOptions& options = {});

}  // namespace holdfast
