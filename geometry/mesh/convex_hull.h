// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// The convex hull of points (3 x n, meters): a closed mesh, faces outwards, with those of the
/// points that are its corners (where three planes or more meet), in the order of their
/// coordinates. Flat polygons have the diagonals that they have when corners are moved by 1e-10 of
/// the size (Jittered). No faces where the points span no volume.
TriangleMesh ConvexHull(const Eigen::Matrix3Xd& points);

/// The same of points of which no four lie in one plane (Jittered): all that its hull has are
/// corners, and its faces are the only ones. A third of the time.
TriangleMesh ConvexHullOfJittered(const Eigen::Matrix3Xd& points);

/// The points (3 x n), each once, in the order of their coordinates.
Eigen::Matrix3Xd DistinctPoints(const Eigen::Matrix3Xd& points);
/// Each point moved by less than `size_m` along each axis, at random but always the same way: no
/// four lie in one plane.
Eigen::Matrix3Xd Jittered(const Eigen::Matrix3Xd& points, double size_m);

}  // namespace holdfast
