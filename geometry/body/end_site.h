// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/body/body_model.h"

namespace holdfast {

/// Where a limb ends: the vertex farthest from `joint` of those that follow it more than any other
/// joint, relative to the joint in the T-pose, meters. Zero where no vertex does.
Eigen::Vector3d EndSite(const BodySurface& surface, int joint);

}  // namespace holdfast
