// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Defaults relative to the extent, the longest side of the bounding box.
inline constexpr double kWrapAlphaPerExtent = 50.0;
inline constexpr double kWrapOffsetPerExtent = 2000.0;

struct WrapOptions {
  double alpha_m = 0.0;   ///< gaps and tunnels narrower than this are bridged; 0: extent / 50
  double offset_m = 0.0;  ///< offset of the wrap outside of the surface; 0: extent / 2000
};

/// Returns a closed, manifold, outward-oriented surface around any triangle soup, by alpha wrapping
/// (Portaneri et al. 2022). Accepts holes, self-intersections and non-manifold edges. Inner
/// cavities are lost, and sharp edges are rounded within alpha. Throws Error for a mesh without
/// area, ids out of range, and coordinates that are not finite.
TriangleMesh WrapSurface(const TriangleMesh& mesh, const WrapOptions& options = {});

}  // namespace holdfast
