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

/// Fitted state of one hand in one frame.
struct HandFrame {
  FingerPose fingers = FingerPose::Zero();
  WristOffset offset;  ///< relative to the clip's wrist
};

/// Fitted state of one frame. `hands` as in the fit's list of hands; entries of hands that do not
/// hold in this frame are unused.
struct FittedFrame {
  ObjectPose object;
  std::array<HandFrame, 2> hands;
};

/// Bit of a hand in Clip::holding_hand.
inline std::uint8_t HoldingBit(Side side) {
  return side == Side::kRight ? kHoldsRight : kHoldsLeft;
}

/// Returns the first frames of `source` with the fitted object track, holding_hand, and the arms
/// and fingers of holding hands. Around holds, fingers (and arms that deviate from the clip) are
/// blended over FitOptions::release_s. Object rotations are unwrapped (no jumps of 2 pi).
Clip ApplyFit(const Clip& source, std::span<const HandModel* const> hands,
              std::span<const std::uint8_t> holding, std::span<const FittedFrame> fitted,
              double release_s);

/// Returns grasps taken from the clip itself: a hand starts a hold with the clip's fingers in that
/// frame and at the clip's hand position on the clip's object. For clips with a captured or
/// predicted object trajectory. `clip` and `hands` must outlive the result.
GraspMaker GraspsFromClip(const Clip& clip, std::span<const HandModel* const> hands);

}  // namespace holdfast
