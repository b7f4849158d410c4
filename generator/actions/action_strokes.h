// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string_view>

#include <Eigen/Core>

#include "generator/actions/face_marks.h"
#include "geometry/clip/clip.h"

namespace holdfast {

/// Adds the periodic hand motion of an action to a clip that reaches its place but has no strokes:
/// hammering (use), shake, chop, cook, brush, and turning an object before the eyes (inspect). Key
/// frames are farther apart than strokes, and networks predict the mean of their phases. Periods
/// and amplitudes are drawn as in the scripts (WriteScript), except for hammers.
///
/// Strokes begin when the right hand has arrived (at three quarters of its maximum displacement
/// relative to the chest) and end when it leaves, within frames 0 to `count` - 1; their number is
/// an integer. A hammer's blows replace periodic arm motion already present in that time. A hammer
/// rises slowly and falls fast, by rotations of wrist, elbow and shoulder in the vertical plane in
/// which it points; at the blow its handle is as level as the wrist allows. The object moves with
/// the hand. Does nothing for other actions, or if there is no time for a stroke.
void AddStrokes(const Eigen::Matrix3Xd& rest_joints, std::string_view action,
                const ObjectMarks& marks, std::uint64_t seed, int count, Clip& clip);

}  // namespace holdfast
