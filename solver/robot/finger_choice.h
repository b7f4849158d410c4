// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "geometry/mesh/mesh.h"
#include "solver/robot/human_demonstration.h"

namespace holdfast {

/// Returns the human fingers (Finger) that the fingers of a robot with two to four of them stand
/// for, the thumb first, then outward from the index finger: those whose contacts in `frame`,
/// together with the palm's, hold the object's weight in every direction with the least friction
/// (HoldsGravity, to 0.1). For equal friction the first fingers are taken, as FindAnatomy does.
///
/// A contact counts as three points, half a centimeter around it, because skin yields. A robot with
/// three or more fingers has a thumb; the two of a gripper stand for any two.
std::vector<int> ChooseFingers(const HumanFrame& frame, const TriangleMesh& object, int fingers);

}  // namespace holdfast
