// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include "geometry/clip/clip.h"
#include "solver/actions/action_studio.h"

namespace holdfast {

/// Places a brush in the hand that passes over the head in frames [begin, end), for CarryObject to
/// fit. The brush is held in every frame; its bristles (ObjectMarks::tip and facing) lie on the
/// skin of the head nearest to the palm and point into it. The wrist is adjusted, blending over 0.6
/// s before and after. Grasp, rotation about the skin normal and tilt are chosen to minimize wrist
/// displacement, wrist bending and penetration of the head by hand and brush. Sets object,
/// holding_hand and fingers of the clip. Returns the chosen one of the given grasps; null for none.
const Grasp* ServeBrush(const ActionActor& actor, const ActionProp& brush,
                        std::span<const Grasp> grasps, Side side, int begin, int end, Clip& clip);

/// Distance of the bristles from the skin of the head in a frame: meters, negative inside.
double BristlesFromHead(const ActionActor& actor, const ObjectMarks& brush, const Clip& clip,
                        int frame);

}  // namespace holdfast
