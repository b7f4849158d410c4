// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/hand_model.h"
#include "solver/grasp/grasp.h"
#include "solver/hand/hand_postures.h"

namespace holdfast {

/// A hand as balls (x, y, z, radius; 4 x n, metres, wrist's frame): those of its fingers, then 16
/// in the palm. The same number, in the same order, for any fingers.
Eigen::Matrix4Xd HandBalls(const HandAnatomy& anatomy, const FingerPose& fingers);

/// Balls with their centres moved.
Eigen::Matrix4Xd MovedBalls(const Eigen::Isometry3d& by, Eigen::Matrix4Xd balls);

}  // namespace holdfast
