// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Where triangles of a closed manifold mesh cut each other (exact predicates): the centre of the
/// first triangle of each pair.
std::vector<Eigen::Vector3d> FindSelfIntersections(const TriangleMesh& mesh);

}  // namespace holdfast
