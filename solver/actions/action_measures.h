// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "geometry/clip/clip.h"
#include "solver/actions/action_clip.h"

namespace holdfast {

/// Fills in what can be measured on the finished clip (of a right-handed person): contact,
/// penetration, body, limits, skating.
void MeasureAction(const ActionActor& actor, const ActionProp& prop, const Clip& clip,
                   ActionQuality& quality);

/// Why a clip of this quality is not to be used: a few words, and with numbers. Both empty when it
/// may be.
struct ActionFault {
  std::string fault, detail;
};
ActionFault FaultOf(const ActionQuality& quality, std::string_view action);

}  // namespace holdfast
