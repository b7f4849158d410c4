// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "geometry/body/hand_model.h"
#include "geometry/clip/clip.h"
#include "geometry/parallel.h"
#include "solver/fit/fit.h"

namespace holdfast {

/// Fitted state of one frame. `hands` as in the fit's list of hands; entries of hands that do not
/// hold in this frame are unused.
struct FittedFrame {
  ObjectPose object;
  std::array<GraspPose, 2> hands;
};

/// Returns the first frames of `source` with the fitted object track, holding_hand, and the arms
/// and fingers of holding hands. Around holds, fingers (and arms that deviate from the clip) are
/// blended over FitOptions::release_s. Object rotations are unwrapped (no jumps of 2 pi).
Clip ApplyFit(const Clip& source, std::span<const HandModel* const> hands,
              std::span<const std::uint8_t> holding, std::span<const FittedFrame> fitted,
              double release_s);

/// Calls visit(t, state) for each frame of a clip, with the hand posed as there, on up to `threads`
/// threads.
template <typename Visit>
void ForEachPosedHand(const Clip& clip, const HandModel& hand, int threads, const Visit& visit) {
  constexpr int kBlock = 16;  // frames that share a scratch hand
  const int frames = clip.NumFrames();
  ParallelFor((frames + kBlock - 1) / kBlock, threads, [&](int block) {
    HandState state(hand);
    for (int t = kBlock * block; t < std::min(frames, kBlock * (block + 1)); ++t) {
      state.SetBody(clip.pose[t], clip.trans.col(t));
      state.Evaluate(FingersOf(clip.pose[t], hand.HandSide()), false);
      visit(t, std::as_const(state));
    }
  });
}

/// Returns grasps taken from the clip itself: a hand starts a hold with the clip's fingers in that
/// frame and at the clip's hand position on the clip's object. For clips with a captured or
/// predicted object trajectory. `clip` and `hands` must outlive the result.
GraspMaker GraspsFromClip(const Clip& clip, std::span<const HandModel* const> hands);

}  // namespace holdfast
