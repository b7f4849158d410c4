// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"
#include "geometry/score/exact_intersection.h"

namespace holdfast {

/// False in a build without CGAL's packages under the GPL (HOLDFAST_GPL=OFF).
bool CanCutSurfaces();

/// Volume of an overlap: cuts both surfaces along their common curve and sums the pieces inside the
/// other body. kNotBuilt if not CanCutSurfaces().
ExactVolume CutVolume(const Solid& solid, const Solid& other, const SolidOverlap& overlap);

/// Returns the points (3 x n) where a surface intersects itself: one point on the common segment of
/// each pair of faces that meet other than in a shared corner or edge. Only tests `faces`. Empty
/// if not CanCutSurfaces().
Eigen::Matrix3Xd SelfCrossings(const TriangleMesh& mesh, std::span<const int> faces);

}  // namespace holdfast
