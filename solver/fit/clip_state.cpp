// SPDX-License-Identifier: MIT
#include "solver/fit/clip_state.h"

#include <algorithm>
#include <cmath>

#include "generator/scripted/minimum_jerk.h"

namespace holdfast {
namespace {

// Blends towards the start of a hold, or away from its end: the deviation of arm and fingers from
// the clip decays with the time to it.
void Blend(const Clip& source, const HandModel& hand, int held_frame, int direction,
           const GraspPose& held, int num_blend, std::span<const std::uint8_t> holding,
           Clip& clip) {
  const Side side = hand.HandSide();
  for (int k = 1; k <= num_blend; ++k) {
    const int t = held_frame + direction * k;
    if (t < 0 || t >= clip.NumFrames() || (holding[t] & HoldingBit(side)) != 0) return;
    const double share = 1.0 - MinimumJerk(static_cast<double>(k) / (num_blend + 1));
    MoveHand(hand, held.offset.Scaled(share), clip.trans.col(t), clip.pose[t]);
    const FingerPose own = FingersOf(source.pose[t], side);
    SetFingers(clip.pose[t], side, own + share * (held.fingers - own));
  }
}

}  // namespace

Clip ApplyFit(const Clip& source, std::span<const HandModel* const> hands,
              std::span<const std::uint8_t> holding, std::span<const FittedFrame> fitted,
              double release_s) {
  const auto frames = static_cast<int>(fitted.size());
  Clip clip = frames < source.NumFrames() ? Slice(source, 0, frames) : source;
  clip.holding_hand.assign(holding.begin(), holding.begin() + frames);
  for (int t = 0; t < frames; ++t) {
    const FittedFrame& frame = fitted[t];
    for (std::size_t h = 0; h < hands.size(); ++h) {
      if ((holding[t] & HoldingBit(hands[h]->HandSide())) == 0) continue;
      MoveHand(*hands[h], frame.hands[h].offset, clip.trans.col(t), clip.pose[t]);
      SetFingers(clip.pose[t], hands[h]->HandSide(), frame.hands[h].fingers);
    }
    // The first frame stays on the rotation branch of the clip.
    clip.object->SetPose(t, frame.object.Transform());
  }

  const int num_blend = std::max(1, static_cast<int>(std::lround(release_s * clip.frame_rate)));
  for (std::size_t h = 0; h < hands.size(); ++h) {
    const std::uint8_t bit = HoldingBit(hands[h]->HandSide());
    for (int t = 1; t < frames; ++t) {
      const bool held = (holding[t] & bit) != 0, was_held = (holding[t - 1] & bit) != 0;
      if (held == was_held) continue;
      const int edge = held ? t : t - 1;
      Blend(source, *hands[h], edge, held ? -1 : +1, fitted[edge].hands[h], num_blend, holding,
            clip);
    }
  }
  return clip;
}

GraspMaker GraspsFromClip(const Clip& clip, std::span<const HandModel* const> hands) {
  return [&clip, hands](const GraspRequest& request) {
    const HandModel& hand = **std::ranges::find_if(
        hands, [&](const HandModel* model) { return model->HandSide() == request.side; });
    const int t = request.frame;
    HandState state(hand);
    state.SetBody(clip.pose[t], clip.trans.col(t));
    const Eigen::Isometry3d target =
        request.object.Transform() * clip.object->Pose(t).inverse() * state.WorldFromWrist();
    return GraspPose{FingersOf(clip.pose[t], request.side),
                     OffsetTo(hand, target, clip.trans.col(t), clip.pose[t])};
  };
}

}  // namespace holdfast
