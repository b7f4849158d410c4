// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <vector>

#include "geometry/body/hand_model.h"
#include "geometry/clip/clip.h"
#include "solver/handover/holds.h"

namespace holdfast {

/// Known facts and settings for finding where an object changes hands.
struct HandoverSearchOptions {
  std::optional<Side> first_hand;  ///< holds it in the first frame; none: to be inferred
  /// Frames of the switches, ascending: used as given, without a search.
  std::vector<int> switch_frames;
  int min_switches = 1;
  int max_switches = 8;
  double reach_m = 0.15;  ///< maximum distance of the hands beyond the object's width
  /// Nats for a switch with the hands as near and still as possible. Negative: such a meeting is
  /// more likely a handover than not, unless the hands' activity before and after contradicts it.
  double switch_cost = -2.0;
  double activity_weight = 2.5;  ///< nats per second for the more active hand
  double dwell_s = 0.3;          ///< duration in which both hold around a given switch
};

/// Finds where an object changes hands in a clip without an object track: where the hands are
/// nearest, hardly move relative to each other, and the other hand is more active afterwards (after
/// Ghosh et al. 2023, section 5.7, which only says "the most likely frame"). Optimized over the
/// whole clip by dynamic programming; the hands must part between two switches. The switch frame is
/// the middle of the interval in which the hands are together. An active hand is raised and moves
/// relative to the trunk.
///
/// The confidence of a switch is its probability relative to the best explanation of the clip
/// without it. `object_size_m` is the object's median extent (of three). Throws Error for frames
/// out of range or not ascending, min_switches above max_switches, a clip of fewer than two frames,
/// and hands that never come within reach although a switch is required; that message names
/// --switch.
HoldLabels FindHandovers(const Clip& clip, const HandModel& right, const HandModel& left,
                         double object_size_m, const HandoverSearchOptions& options = {});

}  // namespace holdfast
