// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string_view>

#include <Eigen/Core>

#include "generator/actions/face_marks.h"
#include "geometry/clip/clip.h"

namespace holdfast {

/// What a hand does over and over in an action: hammering (use), shake, chop, cook, brush, and
/// turning a thing before the eyes (inspect).
bool HasStrokes(std::string_view action);

/// Lays such a rhythm over motion that has the way to where it is done and none of the strokes: key
/// frames stand farther apart than strokes do, and networks answer with the mean of their phases.
/// Periods and widths are drawn as the scripts have them (WriteScript), but a hammer's.
///
/// Strokes begin when the right hand is where it goes (three quarters of its farthest way, as the
/// chest has it) and end when it leaves again, in frames 0 to `count` - 1; a whole number of them.
/// What the arm does over and over by itself in that time is replaced by a hammer's blows. A hammer
/// rises slowly and comes down fast, about wrist, elbow and shoulder, in the vertical plane in
/// which it points; at the blow its handle is as near to level as the wrist allows. The object goes
/// along with the hand. Nothing for other actions, and where there is no time for a stroke.
void AddStrokes(const Eigen::Matrix3Xd& rest_joints, std::string_view action,
                const ObjectMarks& marks, std::uint64_t seed, int count, Clip& clip);

}  // namespace holdfast
