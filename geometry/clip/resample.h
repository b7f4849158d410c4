// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/clip/clip.h"

namespace holdfast {

/// The clip at another frame rate, from its first frame to the last that fits: rotations by the
/// shortest arc between frames, translations linear, `holding_hand` and contact labels by the
/// nearer frame. Throws Error when the frame rate is not positive.
Clip Resample(const Clip& clip, double frame_rate);

/// The same for frames that are far apart (key frames): every rotation and translation goes through
/// the frames along a curve whose velocity does not jump, without going beyond what stays still or
/// turns back (cubic Hermite, tangents limited as Fritsch and Carlson 1980 do; of rotations, cubic
/// Bezier curves on SO(3) by de Casteljau's construction). Both ends are at rest.
Clip ResampleSmoothly(const Clip& clip, double frame_rate);

}  // namespace holdfast
