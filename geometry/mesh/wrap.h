// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Defaults, as shares of the extent: the longest side of the bounding box.
inline constexpr double kWrapAlphaPerExtent = 50.0;
inline constexpr double kWrapOffsetPerExtent = 2000.0;

struct WrapOptions {
  double alpha_m = 0.0;   ///< gaps and tunnels narrower than this are bridged; 0: extent / 50
  double offset_m = 0.0;  ///< the wrap lies this far outside of the surface; 0: extent / 2000
};

/// A closed, manifold, outwards oriented surface around any soup of triangles, by shrinking a wrap
/// onto it (alpha wrapping, Portaneri et al. 2022). Takes holes, self-intersections and
/// non-manifold edges; inner cavities are lost, and sharp edges within alpha are rounded. Throws
/// Error for a mesh without area, ids out of range, coordinates that are not finite.
TriangleMesh WrapSurface(const TriangleMesh& mesh, const WrapOptions& options = {});

}  // namespace holdfast
