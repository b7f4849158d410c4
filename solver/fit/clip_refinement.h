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

/// FitOptions for clips with an object trajectory: close to it and to the clip's fingers.
FitOptions RefinementDefaults();

/// Frames [begin, end) in which a hand holds the object, or (RefinedRest) it lies still.
struct RefinedHold {
  Side side = Side::kRight;
  int begin = 0, end = 0;
  bool rigid = true;          ///< the object's motion in the hand is within the clip's noise
  double noise_mm = 0.0;      ///< white noise of the object's position in the hand, per axis
  double movement_mm = 0.0;   ///< slow translation in the hand, root mean square
  double movement_deg = 0.0;  ///< slow rotation, root mean square
};
struct RefinedRest {
  int begin = 0, end = 0;
  double height_m = 0.0;  ///< of the support
};

/// Frames [begin, end) in which a hand touches the object without moving it.
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

/// Refines a clip with a captured or predicted object trajectory; `holding` gives the hands that
/// hold the object in each frame (FindHolds). Within a hold, the object pose in the hand is the
/// robust mean over the hold, freed of penetration, if it is rigid within the clip's own noise;
/// otherwise the object may slip. Where no hand holds the object and it lies still, it gets one
/// pose and does not sink into its support nearby. All frames are then solved jointly (SolveClip),
/// close to the data. Frames at the ends of a hold where the clip's hand is too far from that pose
/// are removed from the hold; `clip.holding_hand` has what was used.
///
/// In a clip whose object does not move, a hold of at most half the frames is dropped: the hand
/// only touches the object, as it does wherever else it penetrates it. The object stays there, and
/// arm and fingers avoid it. Throws Error for a clip without an object track.
RefineResult RefineClip(const Clip& clip, std::span<const HandModel* const> hands,
                        const FitObject& object, std::span<const std::uint8_t> holding,
                        const FitOptions& options,
                        const std::function<bool(int, int)>& progress = {});

/// Robust mean of poses by iteratively reweighted least squares (Cauchy), rotations on SO(3). A
/// rotation counts as its displacement at 0.1 m.
Eigen::Isometry3d RobustMean(std::span<const Eigen::Isometry3d> poses);

}  // namespace holdfast
