// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/clip/clip.h"

namespace holdfast {

/// Goes on after a motion in which the right hand does something with an object: the hand takes it
/// back to where it was in the first frame, along the way that it came, and the body goes back with
/// it. Where `lets_go`, the object stays there, fingers open and the arm comes to hang as the other
/// one does (`holding_hand` 0; ClearPassages leads the hand off the object). Legs stay as they are
/// in the first and last frame, which is as one stands. Adds nothing where the wrist never went 2
/// cm away. `clip` has an object track and holding_hand.
void AddReturn(const Eigen::Matrix3Xd& rest_joints, bool lets_go, Clip& clip);

}  // namespace holdfast
