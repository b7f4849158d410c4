// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "geometry/body/skeleton.h"

namespace holdfast {

inline constexpr int kSmplxVertices = 10475;

/// The 778 vertices of SMPL-X that are MANO's, ascending (the published correspondence).
std::vector<int> SmplxHandVertices(Side side);

}  // namespace holdfast
