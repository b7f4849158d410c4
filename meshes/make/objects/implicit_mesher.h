// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/mesh/mesh.h"
#include "meshes/make/objects/solids.h"

namespace holdfast {

/// All lengths in millimetres.
struct ImplicitMesherOptions {
  double cell = 0.8;             ///< grid step: half the smallest detail or thinner
  double max_edge = 3.0;         ///< longest triangle edge on flat ground
  double min_edge = 1.0;         ///< shortest edge aimed at, however strong the curvature
  double chord_error = 0.06;     ///< mm between an edge and the curved surface it stands for
  double crease_degrees = 38.0;  ///< surfaces meeting at more than this keep their sharp edge
};

/// The zero set of `solid` within the box, as a closed manifold with even triangles, graded to the
/// curvature, sharp edges kept: dual contouring on a grid, then remeshing on the exact surface.
/// Deterministic. Throws Error where the surface leaves the box, or where no grid resolves it.
TriangleMesh MeshImplicitSurface(const solids::Field& solid, const solids::Vec3& low,
                                 const solids::Vec3& high, const ImplicitMesherOptions& options);

/// Unit gradient of the field by central differences.
solids::Vec3 SurfaceNormal(const solids::Field& solid, const solids::Vec3& point);

}  // namespace holdfast
