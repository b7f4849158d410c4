// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "geometry/body/skeleton.h"

namespace holdfast {

/// Trunk, collarbone and arm changed by as little as it takes to put the wrist on `target` (world,
/// metres): Gauss-Newton for the three coordinates over 16 angles, shoulder and elbow moving most,
/// the step of least weighted norm W J^T (J W J^T + mu I)^-1 r. Zero where the wrist is there
/// already, and smooth in target and frame. The elbow keeps bent by 3 degrees at least. Returns how
/// far the wrist stays from it, metres: a target out of reach is approached.
double PlaceWrist(const Eigen::Matrix3Xd& rest_joints, Side side, const Eigen::Vector3d& target,
                  BodyFrame& frame);

}  // namespace holdfast
