// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Adds the vertices and faces of another mesh, which may overlap this one: nothing is merged.
void Append(const TriangleMesh& more, TriangleMesh& mesh);

}  // namespace holdfast
