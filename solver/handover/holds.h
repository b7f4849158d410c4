// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/hand_model.h"
#include "geometry/clip/clip.h"
#include "geometry/mesh/distance_grid.h"

namespace holdfast {

/// The object goes from one hand to the other.
struct HandSwitch {
  int frame = 0;  ///< middle of the frames that both hold; else the first frame of the other hand
  Side from = Side::kRight;
  Side to = Side::kLeft;
  int both_begin = 0, both_end = 0;  ///< both hold in [begin, end); empty when nothing was shared
  double confidence = 0.0;           ///< probability, in [0, 1]
};

/// Who holds the object, frame by frame.
struct HoldLabels {
  std::vector<std::uint8_t> hands;   ///< per frame: 0 nobody, kHoldsRight, kHoldsLeft, both
  std::vector<HandSwitch> switches;  ///< in the order of time
  /// Per frame, the probability of `hands` given the whole clip.
  std::vector<double> confidence;
};

/// A hand holds what it touches and what stays still in its own frame while it moves. Costs are
/// nats (negative log-likelihoods) per 1/30 s, so that clips of any frame rate are judged alike.
struct HoldOptions {
  double contact_m = 0.010;        ///< skin nearer than this touches, before noise is allowed for
  double contact_scale_m = 0.005;  ///< per this much farther away, one nat less likely to hold
  double still_m_s = 0.06;         ///< an object slower than this does not move, before noise
  double change_cost = 8.0;  ///< nats to take or release: about 0.1 s of clear evidence against it
  int threads = 1;           ///< the result does not depend on it
};

/// Finds who holds the object of a clip that has its trajectory, captured or predicted, noisy or
/// not. Evidence per frame and hand: the gap between its skin and the object; whether the object
/// moves in the wrist's frame; whether it moves in the world, which something at rest does not and
/// what nobody holds cannot. How noisy the clip is is measured in the clip itself. The sequence of
/// {nobody, right, left, both} is decided over the whole clip (ViterbiPath).
/// `object` in the object's frame. Throws Error for a clip without an object track, and for hands
/// that are not a right and a left one.
HoldLabels FindHolds(const Clip& clip, const HandModel& right, const HandModel& left,
                     const DistanceGrid& object, const HoldOptions& options = {});

/// Frames of a sequence of `holding_hand` by who holds.
struct HeldFrames {
  int right = 0, left = 0, both = 0, none = 0;  ///< right and left: that hand alone
  int Total() const { return right + left + both + none; }
};
HeldFrames CountHeld(std::span<const std::uint8_t> hands);

/// The same for people: "the right hand through 133 frames", "the right hand in 48, the left hand
/// in 65 and both hands in 20 of 133 frames".
std::string HoldersText(const HeldFrames& frames);

/// The switches in a sequence of `holding_hand`, with confidence 1.
std::vector<HandSwitch> SwitchesOf(const std::vector<std::uint8_t>& hands);

}  // namespace holdfast
