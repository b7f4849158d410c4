// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

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

/// The clip at these times, in frames of it, at its own frame rate, as Resample has what lies
/// between frames: for motion that is to be faster here and slower there. Throws Error for times
/// before the first frame or after the last.
Clip ResampleAt(const Clip& clip, const std::vector<double>& frames);

/// Those frames of a clip, in that order, with all that it has of each. Frames are of the clip.
Clip TakeFrames(const Clip& clip, const std::vector<int>& frames);

/// `count` frames of a clip evenly from the first to the last.
std::vector<int> EvenFrames(int num_frames, int count);

/// Every n-th frame of a clip.
std::vector<int> EveryFrame(int num_frames, int every);

/// The frames nearest to the times k / `frames_per_second`, so that played at that rate the clip
/// takes the time it took.
std::vector<int> FramesAtRate(int num_frames, double clip_frame_rate, double frames_per_second);

}  // namespace holdfast
