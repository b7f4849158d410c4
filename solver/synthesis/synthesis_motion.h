// SPDX-License-Identifier: MIT
#pragma once

#include "generator/scripted/reach_motion.h"
#include "geometry/clip/clip.h"

namespace holdfast {

/// Key frames of a synthesis as motion: a curve through them (ResampleSmoothly). Feet stay
/// where the first frame has them when no key frame has one 15 cm away; of somebody who steps,
/// those that stand stay where they are (LockFeet). The object's track is the key frames' along the
/// same curve: the fit of all frames makes it anew. The person's rest pose stands on
/// measures.sole_y, the ground is z = 0.
Clip MotionOfKeyFrames(const Clip& keys, const BodyMeasures& measures, double frame_rate);

}  // namespace holdfast
