// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "geometry/score/exact_intersection.h"

namespace holdfast {

/// Returns the intersection volume (m^3) of two closed solids, exact to rounding, in a small
/// fraction of the time of cutting the meshes. Of each face only the outline of the part inside the
/// other solid is found (whole edges, parts of edges, common segments with the other's faces; by
/// exact predicates). The outlines' area vectors sum to the volume (divergence theorem). Returns
/// nothing if a corner or edge lies on the other surface, which requires cutting, or if the
/// outlines do not close.
std::optional<double> ClippedVolume(const Solid& a, const Solid& b, const SolidOverlap& overlap);

/// As IntersectionVolume (geometry/score/contact_metrics.h), with the same result unless a surface
/// intersects itself. Blocks of cubes that no face of the overlap intersects are inside or outside
/// as a whole.
double IntersectionVolume(const Solid& a, const Solid& b, const SolidOverlap& overlap,
                          double voxel_m);

}  // namespace holdfast
