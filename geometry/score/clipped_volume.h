// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "geometry/score/exact_intersection.h"

namespace holdfast {

/// Volume (m^3) of what two closed solids share where they overlap, exact to rounding, in a small
/// part of the time that cutting the meshes takes: of each face only the outline of what is inside
/// the other solid is found (whole edges, parts of edges, common segments with the other's faces;
/// by exact predicates), whose area vectors sum to the volume (divergence theorem). Nothing where a
/// corner or edge lies on the other surface, as that has to be cut, and where the outlines do not
/// close.
std::optional<double> ClippedVolume(const Solid& a, const Solid& b, const SolidOverlap& overlap);

/// As IntersectionVolume (geometry/score/contact_metrics.h), the same number unless a surface
/// crosses itself: blocks of cubes that no face of the overlap reaches into are on one side as a
/// whole.
double IntersectionVolume(const Solid& a, const Solid& b, const SolidOverlap& overlap,
                          double voxel_m);

}  // namespace holdfast
