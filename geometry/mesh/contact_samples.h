// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Points of a surface that something soft would meet first (3 x n, metres): spread over the faces
/// about `spacing_m` apart, and along sharp edges and at vertices, which points spread by area miss
/// and which cut deepest. No two are nearer than half the spacing where one of them would do; not
/// many more than `most` in all. The same mesh gives the same points. Throws Error for a mesh
/// without area.
Eigen::Matrix3Xd ContactSamples(const TriangleMesh& mesh, double spacing_m, int most);

}  // namespace holdfast
