// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include "geometry/body/hand_model.h"
#include "geometry/clip/clip.h"
#include "geometry/mesh/distance_grid.h"

namespace holdfast {

/// Moves hands to and from their holds without sweeping through the object or the fingers of the
/// holding hand. FitClip blends arms and fingers between clip and hold, ignoring obstacles. Here,
/// outwards from the frame at the edge of a hold:
///
///   1. fingers open in place, reversing the closing of FindApproach; the wrist stays on the
///      object;
///   2. the wrist moves from the object to the clip's own pose (minimum jerk in time, including the
///      object's motion), fingers from ready to the clip's;
///   3. where skin would still be deeper than in the hold itself, or an object wall in a finger,
///      the hand retreats smoothly along a line away from the object, by the minimum that clears it
///      (PassageClearance); uses the first timing and line that clears, else the cheapest, and then
///      tries lines in cones around those;
///   4. the acceleration of the wrist's path is reduced without going deeper (EasedWay).
///
/// `source` is the clip before the fit, `clip` the result of FitClip with its holding_hand, `hands`
/// as in the fit. Replaces arm and fingers in frames near a hold, over `release_s`, up to twice
/// that where the clip's path goes through the object. Held frames and the object are unchanged.
void ClearPassages(const Clip& source, std::span<const HandModel* const> hands,
                   const DistanceGrid& object, double release_s, Clip& clip);

}  // namespace holdfast
