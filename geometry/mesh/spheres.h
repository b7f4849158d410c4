// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Spheres of one radius at points (3 x n, meters), for display: octahedra with edges divided into
/// `steps`. Points that are not finite are left out.
TriangleMesh Spheres(const Eigen::Matrix3Xd& points, double radius_m, int steps);

}  // namespace holdfast
