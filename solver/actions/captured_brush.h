// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include "geometry/clip/clip.h"
#include "solver/actions/action_studio.h"

namespace holdfast {

/// How a brush came into a hand that goes over the head.
struct BrushReport {
  const Grasp* grasp = nullptr;  ///< of those given; null: there was none
  double cost = 0.0;
  double wrist_shift_m = 0.0, wrist_turn_rad = 0.0;  ///< most, from the clip's own
};

/// Puts a brush into the hand that goes over the head in frames [begin, end), for CarryObject to
/// fit: held in every frame, its bristles (ObjectMarks::tip and facing) on the skin of the head
/// where the palm is nearest to it, pointing into it. The wrist is adjusted for that, over 0.6 s
/// before and after. Of the grasps, of the brush's turns about the skin's normal and of its tilts,
/// that is taken for which the wrist leaves the capture least, bends least and keeps hand and brush
/// out of the head best. The clip gets object, holding_hand and fingers.
BrushReport ServeBrush(const ActionActor& actor, const ActionProp& brush,
                       std::span<const Grasp> grasps, Side side, int begin, int end, Clip& clip);

/// Distance of the bristles from the skin of the head in a frame: meters, negative inside.
double BristlesFromHead(const ActionActor& actor, const ObjectMarks& brush, const Clip& clip,
                        int frame);

}  // namespace holdfast
