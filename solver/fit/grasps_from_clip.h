// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include "geometry/clip/clip.h"
#include "solver/fit/fit.h"

namespace holdfast {

/// Grasps as the clip itself has them: a hand takes hold with the fingers that the clip shows in
/// that frame, and where the clip's hand is on the clip's object. For clips with an object
/// trajectory, captured or predicted. `clip` and `hands` must outlive what is returned.
GraspMaker GraspsFromClip(const Clip& clip, std::span<const HandModel* const> hands);

}  // namespace holdfast
