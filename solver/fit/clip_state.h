// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "geometry/body/hand_model.h"
#include "geometry/clip/clip.h"
#include "solver/fit/fit.h"
#include "solver/fit/fit_options.h"
#include "solver/unknowns/wrist_offset.h"

namespace holdfast {

/// What a fit decides about one hand in one frame.
struct HandFrame {
  FingerPose fingers = FingerPose::Zero();
  WristOffset offset;  ///< from the clip's wrist
};

/// What a fit decides about one frame. `hands` as in the fit's list of hands; those that do not
/// hold in this frame mean nothing.
struct FittedFrame {
  ObjectPose object;
  std::array<HandFrame, 2> hands;
};

/// The bit of a hand in Clip::holding_hand.
inline std::uint8_t HoldingBit(Side side) {
  return side == Side::kRight ? kHoldsRight : kHoldsLeft;
}

/// The first frames of `source` as fitted: object track, holding_hand, and arms and fingers of the
/// hands that hold. Hands come and go gently: fingers, and arms where they are off the clip's, are
/// blended over FitOptions::release_s. Object rotations come out unwrapped (no jumps of 2 pi).
Clip ApplyFit(const Clip& source, std::span<const HandModel* const> hands,
              std::span<const std::uint8_t> holding, std::span<const FittedFrame> fitted,
              double release_s);

/// Grasps as the clip itself has them: a hand takes hold with the fingers that the clip shows in
/// that frame, and where the clip's hand is on the clip's object. For clips with an object
/// trajectory, captured or predicted. `clip` and `hands` must outlive what is returned.
GraspMaker GraspsFromClip(const Clip& clip, std::span<const HandModel* const> hands);

}  // namespace holdfast
