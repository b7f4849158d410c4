// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

#include "geometry/clip/clip.h"
#include "solver/actions/action_studio.h"

namespace holdfast {

/// The right arm as it is comfortable with the hand where it is (ArmIk::Track): networks lift
/// elbows to the shoulder. Nothing changes in the first frame, all of it is there when the hand has
/// gone farthest; `elbow_rad` is added to where elbows are then, up and out. A brush is turned
/// about its bristles until it comes to the mouth from the side, as the scripts have it. `clip`: of
/// a right-handed person, its object that of `prop`, which goes along with the hand.
void EaseArm(const ActionActor& actor, const ActionProp& prop, std::string_view action,
             double elbow_rad, Clip& clip);

}  // namespace holdfast
