// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/clip.h"

namespace holdfast {

/// The clip at another frame rate, from its first frame to the last that fits: rotations by the
/// shortest arc between frames, translations linear, `holding_hand` and contact labels by the
/// nearer frame. Throws Error when the frame rate is not positive.
Clip Resample(const Clip& clip, double frame_rate);

}  // namespace holdfast
