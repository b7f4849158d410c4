// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/clip/clip.h"

namespace holdfast {

/// Appends a return to a motion in which the right hand uses an object: the hand moves it back to
/// its first position along the same path, and the body follows. If `lets_go`, the object then
/// stays there, the fingers open and the arm comes to hang like the other one (`holding_hand` 0;
/// ClearPassages moves the hand off the object). Legs keep their first and last pose, which is
/// standing. Nothing is appended if the wrist never moved 2 cm. `clip` needs an object track and
/// holding_hand.
void AddReturn(const Eigen::Matrix3Xd& rest_joints, bool lets_go, Clip& clip);

}  // namespace holdfast
