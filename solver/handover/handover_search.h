// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <vector>

#include "geometry/body/hand_model.h"
#include "geometry/clip/clip.h"
#include "solver/handover/holds.h"

namespace holdfast {

/// What is known or asked about where an object changes hands.
struct HandoverSearchOptions {
  std::optional<Side> first_hand;  ///< who has it in the first frame; none: decided with the rest
  /// Frames where it switches, ascending: taken as they are, and nothing is searched for.
  std::vector<int> switch_frames;
  int min_switches = 1;
  int max_switches = 8;
  double reach_m = 0.15;  ///< hands this much farther apart than the object is wide pass nothing
  /// Nats for a switch where the hands could not be nearer or stiller. Negative: such a meeting is
  /// more likely a handover than not, unless what the hands do before and after speaks against it.
  double switch_cost = -2.0;
  double activity_weight = 2.5;  ///< nats per second for the hand that does more
  double dwell_s = 0.3;          ///< both hold for about this long around a switch that was given
};

/// Finds where an object changes hands in a clip that has no object yet: where the hands are
/// nearest, hardly move relative to each other, and the other hand is the busier one afterwards
/// (after Ghosh et al. 2023, section 5.7, which says "the most likely frame" and no more). Chosen
/// over the whole clip by dynamic programming; hands must part between two switches. The frame is
/// the middle of the time that the hands are together. A hand that is busy is one that is raised
/// and moves relative to the trunk.
///
/// A switch's confidence is its probability against the best account of the clip without it.
/// `object_size_m` is the object's middle extent (of three). Throws Error for frames out of range
/// or not ascending, more switches asked for at least than at most, a clip of fewer than two
/// frames, and hands that never come within reach although a switch is asked for: that names
/// --switch.
HoldLabels FindHandovers(const Clip& clip, const HandModel& right, const HandModel& left,
                         double object_size_m, const HandoverSearchOptions& options = {});

}  // namespace holdfast
