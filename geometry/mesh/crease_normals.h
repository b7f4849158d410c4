// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// A mesh as pictures need it: one unit normal per vertex, vertices doubled along sharp edges.
struct ShadedMesh {
  TriangleMesh mesh;
  Eigen::Matrix3Xd normals;  ///< (3 x V), unit length
};

/// Doubles vertices where faces around them meet at more than `crease_rad`, so that edges of a box
/// stay sharp and a sphere stays smooth. Normals are face normals weighted by corner angle; corners
/// of faces without area take (0, 0, 1). Faces keep their order; vertices without faces are left
/// out. The default is about 35 degrees.
ShadedMesh SplitAtCreases(const TriangleMesh& mesh, double crease_rad = 0.6);

}  // namespace holdfast
