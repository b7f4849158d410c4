// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/mesh/decimate.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

/// False in a build without CGAL's packages under the GPL (HOLDFAST_GPL=OFF): OpenMesh then
/// collapses edges by the quadrics of the faces' planes, whatever the method.
bool HasDecimateMethods();

/// Collapses edges until `options.vertices` are left, or as far as topology allows. The mesh must
/// be manifold. Throws Error if it is not.
TriangleMesh CollapseEdges(const TriangleMesh& mesh, const DecimateOptions& options);

}  // namespace holdfast
