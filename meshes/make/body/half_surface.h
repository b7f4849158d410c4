// SPDX-License-Identifier: MIT
#pragma once

#include <functional>

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// The part x >= 0 of a zero set by marching tetrahedra (Doi and Koide 1991) on a grid of `spacing`
/// within `low`..`high`, low.x() == 0: a manifold whose border lies exactly on x = 0, faces
/// outwards. Only the grid's blocks near the surface are visited: `value` must be negative inside
/// and, up to a factor of three, no more than the distance to the surface.
TriangleMesh PolygoniseHalf(const std::function<double(const Eigen::Vector3d&)>& value,
                            const Eigen::Vector3d& low, const Eigen::Vector3d& high,
                            double spacing);

}  // namespace holdfast
