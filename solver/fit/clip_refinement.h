// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "geometry/body/hand_model.h"
#include "geometry/clip/clip.h"
#include "solver/fit/clip_solver.h"
#include "solver/fit/fit_options.h"

namespace holdfast {

/// FitOptions for clips that have an object trajectory: near to it and to the clip's fingers.
FitOptions RefinementDefaults();

/// The frames [begin, end) that a hand holds, or that the object lies in.
struct RefinedHold {
  Side side = Side::kRight;
  int begin = 0, end = 0;
  bool rigid = true;          ///< the object does not move in the hand beyond the clip's noise
  double noise_mm = 0.0;      ///< white noise of the object's place in the hand, per axis
  double movement_mm = 0.0;   ///< slow movement in the hand, root mean square
  double movement_deg = 0.0;  ///< and slow turning
};
struct RefinedRest {
  int begin = 0, end = 0;
  double height_m = 0.0;  ///< of what it lies on
};

/// The frames [begin, end) that a hand is at the object without moving it.
struct RefinedTouch {
  Side side = Side::kRight;
  int begin = 0, end = 0;
};

struct RefineResult {
  Clip clip;  ///< refined object track, arms and fingers, holding_hand (with touches)
  std::vector<RefinedHold> holds;
  std::vector<RefinedRest> rests;
  std::vector<RefinedTouch> touches;
  ClipReport report;
};

/// Cleans a clip whose object trajectory was captured or predicted: `holding` says who holds in
/// each frame (FindHolds). Where a hand holds, its relation to the object is the robust mean over
/// the hold if that is rigid within the noise that the clip itself shows, freed of penetration, and
/// else may slip. Where nobody holds and the object lies still it lies in one place, and sinks in
/// nowhere near it. All frames are then solved at once (SolveClip), near the data. Hands that the
/// clip shows farther from their relation at the ends of a hold do not hold there yet, or any more:
/// `clip.holding_hand` has what was used.
///
/// In a clip whose object goes nowhere, a hold for less than half of it is none: the hand touches,
/// as it does wherever else it gets into the object. The object stays there, and arm and fingers
/// avoid it. Throws Error for a clip without an object track.
RefineResult RefineClip(const Clip& clip, std::span<const HandModel* const> hands,
                        const FitObject& object, std::span<const std::uint8_t> holding,
                        const FitOptions& options,
                        const std::function<bool(int, int)>& progress = {});

/// The mean of poses with outliers counting less: iteratively reweighted (Cauchy), rotations on
/// SO(3). A turn counts as what it moves 0.1 m away.
Eigen::Isometry3d RobustMean(std::span<const Eigen::Isometry3d> poses);

}  // namespace holdfast
