// SPDX-License-Identifier: MIT
#pragma once

#include <array>

#include "meshes/make/body/body_skeleton.h"

namespace holdfast {

/// Unit axis about which positive angles curl a finger of the left hand towards the palm at joint
/// k.
Eigen::Vector3d LeftFlexionAxis(Finger finger, int k);

/// A hand at ease, fingers slightly curled, more so towards the little finger: axis-angle of its 15
/// joints relative to the rest pose (hands_mean).
std::array<double, kHandDofs> RelaxedHand(Side side);

/// Direction out of the back of a finger of the left hand: up, and for the thumb turned half a
/// right angle so that its pad faces the palm.
Eigen::Vector3d LeftDorsalDirection(Finger finger);

}  // namespace holdfast
