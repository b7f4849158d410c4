// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// The convex hull of points (3 x n, metres): a closed mesh, faces outwards, with those of the
/// points that are its corners, in the order of their coordinates; the same every time. No faces
/// where the points span no volume.
TriangleMesh ConvexHull(const Eigen::Matrix3Xd& points);

}  // namespace holdfast
