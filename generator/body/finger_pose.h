// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/body/hand_model.h"
#include "geometry/body/skeleton.h"

namespace holdfast {

/// The hand of an arm that hangs: fingers curled a little, more towards the little finger.
FingerPose RelaxedFingers(const Eigen::Matrix3Xd& rest_joints, Side side);

/// A hand that takes something: `closure` 0 is open and spread, ready to receive; 1 is closed
/// around a handle of a few centimeters, thumb opposed. In between the fingers close together.
/// Bends about each finger's own axis, taken from the bones of `rest_joints` (3 x 55), within a
/// hand's range.
FingerPose GraspingFingers(const Eigen::Matrix3Xd& rest_joints, Side side, double closure);

}  // namespace holdfast
