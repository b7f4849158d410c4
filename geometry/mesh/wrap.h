// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Returns a closed, manifold, outward-oriented surface around any triangle soup, by alpha wrapping
/// (Portaneri et al. 2022). Gaps and tunnels narrower than `alpha_m` are bridged; the wrap is
/// `offset_m` outside of the surface. Accepts holes, self-intersections and non-manifold edges.
/// Inner cavities are lost, and sharp edges are rounded within alpha. Throws Error for a mesh
/// without area, ids out of range, and coordinates that are not finite.
TriangleMesh WrapSurface(const TriangleMesh& mesh, double alpha_m, double offset_m);

}  // namespace holdfast
