// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// A surface as OpenMesh's half-edge mesh, for questions about neighbors. Any triangle soup can be
/// asked about: a face that a half-edge mesh cannot hold, because an edge of it has two faces
/// already or runs the other way round, stands apart there, with vertices of its own.
class HalfEdges {
 public:
  /// Faces with a repeated corner are left out. Vertex ids must be in range.
  explicit HalfEdges(const TriangleMesh& mesh);
  ~HalfEdges();
  HalfEdges(HalfEdges&&) noexcept;
  HalfEdges& operator=(HalfEdges&&) noexcept;

  /// How many faces stand apart. 0: every edge has one face, or two that agree.
  int NumApart() const;

  /// The loops around holes, each by its vertices in the order in which the faces beside the hole
  /// have them. No order of loops is promised but that it is the same in every run.
  std::vector<std::vector<int>> BoundaryLoops() const;

  /// Edges (low id, high id) with one face, or two that meet at more than `angle_rad`. Ascending,
  /// each once.
  std::vector<std::pair<int, int>> SharpEdges(double angle_rad) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace holdfast
