// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"

namespace holdfast::apps {

/// A ball of 4 cm, 12 x 8 facets, at each goal.
TriangleMesh GoalMarkers(std::span<const Eigen::Vector3d> goals);

}  // namespace holdfast::apps
