// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Feature of a triangle on which a point lies.
enum class TriangleFeature { kFace, kEdge01, kEdge12, kEdge20, kVertex0, kVertex1, kVertex2 };

struct TrianglePoint {
  Eigen::Vector3d point;
  TriangleFeature feature = TriangleFeature::kFace;
};

/// Returns the point of triangle abc nearest to p, and p's Voronoi region (Ericson 2005, 5.1.5).
TrianglePoint ClosestOnTriangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                const Eigen::Vector3d& b, const Eigen::Vector3d& c);

/// Nearest points on a triangle soup, by a tree of axis-aligned boxes, eight per node. Boxes in
/// single precision, rounded outwards, cull triangles; the remaining triangles are measured in
/// double precision. Queries are const and may run on any number of threads.
class TriangleTree {
 public:
  struct Hit {
    Eigen::Vector3d point;
    TriangleFeature feature = TriangleFeature::kFace;
    int face = -1;  ///< column of the mesh's faces
    double squared_distance = 0.0;
  };

  /// Ignores faces without area. Throws Error if none is left, for ids out of range, and for
  /// coordinates that are not finite.
  explicit TriangleTree(const TriangleMesh& mesh);
  ~TriangleTree();
  TriangleTree(TriangleTree&&) noexcept;
  TriangleTree& operator=(TriangleTree&&) noexcept;

  /// Moves the vertices of the same faces. Boxes are refitted in a small fraction of the
  /// construction time. Faces ignored at construction stay ignored.
  void Move(const TriangleMesh& mesh);

  /// Returns the nearest point; among equally near faces the first. `hint_face` (the face hit by a
  /// nearby query) shortens the search and does not change the result.
  Hit Closest(const Eigen::Vector3d& query, int hint_face = -1) const;

  /// Returns the faces whose boxes overlap the box [low, high] up to rounding, ascending.
  std::vector<int> FacesInBox(const Eigen::Vector3d& low, const Eigen::Vector3d& high) const;

  const Eigen::Vector3d& Min() const;
  const Eigen::Vector3d& Max() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace holdfast
