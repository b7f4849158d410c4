// SPDX-License-Identifier: MIT
#pragma once

#include "meshes/make/objects/implicit_mesher.h"

namespace holdfast {

/// Remeshes a dense closed triangulation of `solid`'s surface into even triangles graded to the
/// curvature (edges split, collapsed, flipped, vertices relaxed and put back on the surface; Botsch
/// and Kobbelt 2004 with a sizing field). Sharp edges become chains of mesh edges that are only
/// resampled along themselves. Millimetres; deterministic.
TriangleMesh RemeshOnSurface(const TriangleMesh& dense, const solids::Field& solid,
                             const ImplicitMesherOptions& options);

}  // namespace holdfast
