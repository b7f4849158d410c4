// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/body/hand_model.h"
#include "geometry/body/skeleton.h"

namespace holdfast {

/// Returns the hand pose of a hanging arm: fingers slightly curled, more towards the little finger.
FingerPose RelaxedFingers(const Eigen::Matrix3Xd& rest_joints, Side side);

/// Returns a grasping hand pose: `closure` 0 is open and spread, ready to receive; 1 is closed
/// around a handle of a few centimeters with the thumb opposed. In between, the fingers close
/// together. Flexes each finger about its own axis, derived from the bones of `rest_joints` (3 x
/// 55), within the range of a hand.
FingerPose GraspingFingers(const Eigen::Matrix3Xd& rest_joints, Side side, double closure);

}  // namespace holdfast
