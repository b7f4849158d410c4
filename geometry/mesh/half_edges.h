// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Half-edge mesh (OpenMesh) for adjacency queries on any triangle soup. A face that a half-edge
/// mesh cannot represent, because one of its edges already has two faces or is oriented the other
/// way, is detached: it gets vertices of its own.
class HalfEdges {
 public:
  /// Ignores faces with a repeated corner. Vertex ids must be in range.
  explicit HalfEdges(const TriangleMesh& mesh);
  ~HalfEdges();

  /// Number of detached faces. If 0, every edge has one face, or two consistently oriented faces.
  int NumApart() const;

  /// Returns the boundary loops of the holes, each as its vertices in the orientation of the
  /// adjacent faces. The order of the loops is unspecified but deterministic.
  std::vector<std::vector<int>> BoundaryLoops() const;

  /// Returns the edges (low id, high id) that have one face, or two whose dihedral angle exceeds
  /// `angle_rad`. Sorted, without duplicates.
  std::vector<std::pair<int, int>> SharpEdges(double angle_rad) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace holdfast
