// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include "geometry/body/hand_model.h"
#include "geometry/clip/clip.h"
#include "geometry/mesh/distance_grid.h"

namespace holdfast {

/// Leads hands to their holds and away from them without sweeping through the object or through
/// the fingers of the hand that holds it. FitClip blends arms and fingers between the clip's own
/// and the hold's, whatever lies between; here, from the frame at the edge of a hold outwards,
///
///   1. fingers open in place as FindApproach has them close, while the wrist stays on the object;
///   2. the wrist goes from its place on the object over to the clip's own (minimum jerk in time,
///      the object's motion included), fingers from ready to the clip's own;
///   3. where skin would still be deeper than in the hold itself, or a wall of the object in a
///      finger, the hand keeps farther off along a line away from the object, by as little as
///      clears it, coming and going smoothly (PassageClearance). Of several timings and lines, the
///      first that clears or the one that costs least; then lines in cones around those;
///   4. the wrist's way through the world loses what acceleration it can without going deeper
///      (EasedWay).
///
/// `source` is the clip before the fit, `clip` what FitClip returned, with its holding_hand: of
/// frames near a hold's first and last one, in which that hand does not hold, the arm and fingers
/// are made anew, over `release_s` and up to twice that where the clip's own way is through the
/// object. `hands` as for the fit. Frames that hold are not changed, nor the object.
void ClearPassages(const Clip& source, std::span<const HandModel* const> hands,
                   const DistanceGrid& object, double release_s, Clip& clip);

}  // namespace holdfast
