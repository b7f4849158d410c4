// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "geometry/body/body_model.h"

namespace holdfast {

/// Which of a hand's joints (the wrist, fifteen of the fingers) moves each vertex most; -1 for
/// vertices of other parts.
std::vector<int> StrongestHandJoints(const BodySurface& surface, Side side);

}  // namespace holdfast
