// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// The convex hull of points (3 x n, metres): a closed mesh, faces outwards, with those of the
/// points that are its corners, in the order of their coordinates. Of points in one plane the
/// diagonals, and which of nearly straight edges has a corner, may differ from run to run: they
/// depend on CGAL's memory. No faces where the points span no volume.
TriangleMesh ConvexHull(const Eigen::Matrix3Xd& points);

/// The points (3 x n), each once, in the order of their coordinates.
Eigen::Matrix3Xd DistinctPoints(const Eigen::Matrix3Xd& points);
/// Each point moved by less than `size_m` along each axis, always the same way (the R3 sequence of
/// points in a cube): no four lie in one plane.
Eigen::Matrix3Xd Jittered(const Eigen::Matrix3Xd& points, double size_m);

}  // namespace holdfast
