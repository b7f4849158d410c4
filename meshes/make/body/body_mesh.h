// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "geometry/mesh/mesh.h"
#include "meshes/make/body/body_shape.h"

namespace holdfast {

/// The mesh of a body that mirrors itself at x = 0, by the order of its vertices:
///   [0, num_midline)                        on x = 0
///   [num_midline, num_midline + num_side)   left (x > 0), the hand last
///   [num_midline + num_side, end)           right, in the order of the left.
struct BodyMesh {
  TriangleMesh mesh;
  int num_midline = 0;
  int num_side = 0;

  int MirrorVertex(int vertex) const {
    if (vertex < num_midline) return vertex;
    return vertex < num_midline + num_side ? vertex + num_side : vertex - num_side;
  }
  /// Vertices of the midline and the left: what has to be computed, the rest follows by mirroring.
  int NumLeftAndMidline() const { return num_midline + num_side; }
};

/// Meshes the shape with edges of TargetEdgeLength. Coordinates are rounded to float32, so that the
/// mirror image stays exact in the file.
BodyMesh MeshBody(const BodyShape& shape);

/// Per vertex its neighbours over the edges, ascending.
std::vector<std::vector<int>> VertexNeighbours(const TriangleMesh& mesh);

/// Vertices of a hand, wrist and beyond, ascending.
std::vector<int> HandVertices(const BodyMesh& body, Side side);

}  // namespace holdfast
