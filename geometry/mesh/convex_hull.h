// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Returns the convex hull of points (3 x n, meters): a closed mesh with outward faces. Its
/// vertices are the input points at which three or more planes meet, sorted by coordinates. Flat
/// polygons are triangulated as if their corners were moved by 1e-10 of the size (Jittered).
/// Returns no faces if the points span no volume.
TriangleMesh ConvexHull(const Eigen::Matrix3Xd& points);

/// ConvexHull for points of which no four are coplanar (see Jittered). All hull vertices are then
/// corners, and the triangulation is unique. Takes a third of the time.
TriangleMesh ConvexHullOfJittered(const Eigen::Matrix3Xd& points);

/// Returns the distinct points (3 x n), sorted by coordinates.
Eigen::Matrix3Xd DistinctPoints(const Eigen::Matrix3Xd& points);
/// Moves each point by less than `size_m` along each axis, pseudo-randomly but deterministically,
/// so that no four points are coplanar.
Eigen::Matrix3Xd Jittered(const Eigen::Matrix3Xd& points, double size_m);

}  // namespace holdfast
