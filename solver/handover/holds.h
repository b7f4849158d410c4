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

/// The object passes from one hand to the other.
struct HandSwitch {
  int frame = 0;  ///< middle of the frames both hold; else the first frame of the other hand
  Side from = Side::kRight;
  Side to = Side::kLeft;
  int both_begin = 0, both_end = 0;  ///< both hold in [begin, end); may be empty
  double confidence = 0.0;           ///< probability, in [0, 1]
};

/// Holding hands per frame.
struct HoldLabels {
  std::vector<std::uint8_t> hands;   ///< per frame: 0 none, kHoldsRight, kHoldsLeft, both
  std::vector<HandSwitch> switches;  ///< in temporal order
  /// Per frame, the probability of `hands` given the whole clip.
  std::vector<double> confidence;
};

/// Finds the hands that hold the object in a clip with its trajectory, captured or predicted, noisy
/// or not. Evidence per frame and hand: the gap between skin and object; the object's motion in the
/// wrist frame; and its motion in the world, which an object at rest does not show and an object
/// without a hand cannot. The noise level is estimated from the clip. The sequence of {none, right,
/// left, both} is optimized over the whole clip (ViterbiPath); costs are nats per 1/30 s, so they
/// do not depend on the frame rate. `object` is in the object frame. The result does not depend on
/// `threads`. Throws Error for a clip without an object track, and for hands that are not a right
/// and a left one.
HoldLabels FindHolds(const Clip& clip, const HandModel& right, const HandModel& left,
                     const DistanceGrid& object, int threads = 1);

/// Counts of the frames of a `holding_hand` sequence by holder.
struct HeldFrames {
  int right = 0, left = 0, both = 0, none = 0;  ///< right and left: that hand alone
  int Total() const { return right + left + both + none; }
};
HeldFrames CountHeld(std::span<const std::uint8_t> hands);

/// Message text: "the right hand through 133 frames", "the right hand in 48, the left hand in 65
/// and both hands in 20 of 133 frames".
std::string HoldersText(const HeldFrames& frames);

/// Switches in a `holding_hand` sequence, with confidence 1.
std::vector<HandSwitch> SwitchesOf(const std::vector<std::uint8_t>& hands);

}  // namespace holdfast
