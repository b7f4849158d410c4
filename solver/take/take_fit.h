// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <vector>

#include "geometry/clip/clip.h"
#include "solver/fit/fit.h"
#include "solver/take/take_motion.h"

namespace holdfast {

/// Fits the object to the hand (FitClip) from the take on; the frames before stay. Throws what
/// FitClip throws. `frames` may be null.
Clip FitTaken(const TakeMotion& motion, const HandModel& hand, const FitObject& object,
              const FitOptions& options, std::vector<FrameReport>* frames = nullptr,
              const std::function<bool(int, int)>& progress = {});

}  // namespace holdfast
