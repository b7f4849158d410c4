// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "geometry/clip/clip.h"

namespace holdfast {

/// Resamples a clip to another frame rate, from its first frame to the last that fits. Rotations
/// are interpolated by shortest arcs, translations linearly, `holding_hand` and contact labels by
/// the nearest frame. Throws Error if the frame rate is not positive.
Clip Resample(const Clip& clip, double frame_rate);

/// Resample for widely spaced frames (key frames): every rotation and translation follows a curve
/// of continuous velocity through the frames, without overshoot where it is still or reverses
/// (cubic Hermite, tangents limited as in Fritsch and Carlson 1980; for rotations, cubic Bezier
/// curves on SO(3) by de Casteljau's construction). Velocity is zero at both ends.
Clip ResampleSmoothly(const Clip& clip, double frame_rate);

/// Returns the clip at these times, in units of its frames, at its own frame rate, interpolated as
/// in Resample: for time warping. Throws Error for times before the first frame or after the last.
Clip ResampleAt(const Clip& clip, const std::vector<double>& frames);

/// Returns these frames of a clip, in this order, with all their data.
Clip TakeFrames(const Clip& clip, const std::vector<int>& frames);

/// Returns `count` frames evenly spaced from the first to the last.
std::vector<int> EvenFrames(int num_frames, int count);

/// Returns every n-th frame of a clip.
std::vector<int> EveryFrame(int num_frames, int every);

/// Returns the frames nearest to the times k / `frames_per_second`, so that playback at that rate
/// keeps the clip's duration.
std::vector<int> FramesAtRate(int num_frames, double clip_frame_rate, double frames_per_second);

}  // namespace holdfast
