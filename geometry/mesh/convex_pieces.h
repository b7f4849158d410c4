// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "geometry/mesh/mesh.h"

namespace holdfast {

struct ConvexPieceOptions {
  double tolerance_m = 0.002;  ///< how far a piece may reach out of the solid
  int max_pieces = 48;         ///< then the worst stay as they are
  int vertices = 300;          ///< of the surface that is cut
  int threads = 1;             ///< the result does not depend on them
};

struct ConvexPieces {
  std::vector<TriangleMesh> pieces;  ///< closed, convex, in the mesh's frame, meters
  double excess_m = 0.0;             ///< farthest that a piece reaches out of the decimated solid
};

/// A solid as convex pieces, for engines that collide nothing else: decimated to
/// `options.vertices`, then cut by planes, the piece that reaches out farthest first, each by the
/// plane (nine directions, three places) that leaves least of the two halves' hulls outside the
/// solid; after V-HACD (Mamou & Ghorbel 2009), with the excess measured by signed distance on the
/// hull's surface as in CoACD (Wei et al. 2022). Deterministic. Throws Error for a mesh that spans
/// no volume.
ConvexPieces SplitIntoConvexPieces(const TriangleMesh& mesh,
                                   const ConvexPieceOptions& options = {});

}  // namespace holdfast
