// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"

namespace holdfast {

inline bool HasRepeatedCorner(const Eigen::Vector3i& face) {
  return face[0] == face[1] || face[1] == face[2] || face[2] == face[0];
}

/// Disjoint sets of 0 .. n-1 (union-find with path halving).
class DisjointSets {
 public:
  explicit DisjointSets(int n);
  int Find(int element);
  /// The smaller root is kept: the root of a set is its first element, in any order of merging.
  void Merge(int a, int b);

 private:
  std::vector<int> parent_;
};

/// The edges of a triangle soup, each with the face corners at which it starts: corner c = 3 f + k
/// denotes the side from corner k to corner k + 1 of face f. Takes eight bytes per corner and four
/// per vertex.
class EdgeTable {
 public:
  /// Ignores faces with a repeated corner. Ids must be in range.
  EdgeTable(const Eigen::Matrix3Xi& faces, Eigen::Index num_vertices);

  /// Calls visit(low, high, corners) for every edge, low < high, ascending; `corners` ascends too.
  template <typename Visit>
  void ForEach(Visit&& visit) const {
    for (std::size_t low = 0; low + 1 < begin_.size(); ++low) {
      for (int i = begin_[low], end = i; i < begin_[low + 1]; i = end) {
        while (end < begin_[low + 1] && sides_[end].first == sides_[i].first) ++end;
        corners_.clear();
        for (int s = i; s < end; ++s) corners_.push_back(sides_[s].second);
        visit(static_cast<int>(low), sides_[i].first, std::span<const int>(corners_));
      }
    }
  }

 private:
  std::vector<int> begin_;                  // per low vertex
  std::vector<std::pair<int, int>> sides_;  // high vertex and corner, sorted for each low vertex
  mutable std::vector<int> corners_;
};

struct EdgeCounts {
  Eigen::Index all = 0;
  Eigen::Index boundary = 0;      ///< edges of one face
  Eigen::Index non_manifold = 0;  ///< edges of three or more faces
  Eigen::Index misoriented = 0;   ///< edges that two faces traverse in the same direction
};

/// Counts the edges of `faces`; `edges` is their edge table.
EdgeCounts CountEdges(const Eigen::Matrix3Xi& faces, const EdgeTable& edges);

/// Returns the fans: sets of corners (3 f + k) of one vertex that are joined through shared edges.
DisjointSets FindFans(const Eigen::Matrix3Xi& faces, const EdgeTable& edges);

/// Returns the start of each vertex's range (one more than vertices), and in these ranges the
/// corners (3 f + k) at the vertices, ascending.
std::pair<std::vector<int>, std::vector<int>> CornersByVertex(const Eigen::Matrix3Xi& faces,
                                                              Eigen::Index num_vertices);

/// A mesh for rendering: one unit normal per vertex, vertices duplicated along sharp edges.
struct ShadedMesh {
  TriangleMesh mesh;
  Eigen::Matrix3Xd normals;  ///< (3 x V), unit length
};

/// Duplicates vertices whose adjacent faces meet at more than `crease_rad`, so that box edges stay
/// sharp and spheres smooth. Normals are face normals weighted by corner angle; corners of faces
/// without area get (0, 0, 1). Faces keep their order; vertices without faces are dropped. The
/// default is about 35 degrees.
ShadedMesh SplitAtCreases(const TriangleMesh& mesh, double crease_rad = 0.6);

}  // namespace holdfast
