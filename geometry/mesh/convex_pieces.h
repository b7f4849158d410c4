// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "geometry/mesh/mesh.h"

namespace holdfast {

struct ConvexPieceOptions {
  double tolerance_m = 0.002;  ///< maximum distance that a piece may extend out of the solid
  int vertices = 300;          ///< vertices of the decimated surface that is cut
  int threads = 1;             ///< does not change the result
};

struct ConvexPieces {
  std::vector<TriangleMesh> pieces;  ///< closed, convex, in the mesh's frame, meters
  double excess_m = 0.0;             ///< largest extent of a piece out of the decimated solid
};

/// Splits a solid into convex pieces, for engines that only collide convex shapes; at most 48, of
/// which some may then be above the tolerance. The mesh is decimated to `options.vertices` and then
/// cut by planes, starting with the piece of largest excess. Of 27 candidate planes (nine
/// directions, three offsets) the one that leaves the least of the two halves' hulls outside the
/// solid is used. After V-HACD (Mamou & Ghorbel 2009), with the excess measured by signed distance
/// on the hull's surface as in CoACD (Wei et al. 2022). Deterministic. Throws Error for a mesh that
/// spans no volume.
ConvexPieces SplitIntoConvexPieces(const TriangleMesh& mesh,
                                   const ConvexPieceOptions& options = {});

}  // namespace holdfast
