// SPDX-License-Identifier: MIT
#pragma once

#include <memory>

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Where on a triangle a point lies.
enum class TriangleFeature { kFace, kEdge01, kEdge12, kEdge20, kVertex0, kVertex1, kVertex2 };

struct TrianglePoint {
  Eigen::Vector3d point;
  TriangleFeature feature = TriangleFeature::kFace;
};

/// The point of triangle abc nearest to p, and the Voronoi region p falls in (Ericson 2005, 5.1.5).
TrianglePoint ClosestOnTriangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                const Eigen::Vector3d& b, const Eigen::Vector3d& c);

/// Nearest point on a triangle soup, by CGAL's tree of axis-aligned boxes. Const after
/// construction; queries may run on any number of threads.
class TriangleTree {
 public:
  struct Hit {
    Eigen::Vector3d point;
    TriangleFeature feature = TriangleFeature::kFace;
    int face = -1;  ///< column of the mesh's faces
    double squared_distance = 0.0;
  };

  /// Faces without area are left out. Throws Error when none is left, for ids out of range, and for
  /// coordinates that are not finite.
  explicit TriangleTree(const TriangleMesh& mesh);
  ~TriangleTree();
  TriangleTree(TriangleTree&&) noexcept;
  TriangleTree& operator=(TriangleTree&&) noexcept;

  /// The nearest point. `hint_face` (a face of a nearby query's hit) shortens the search and
  /// changes the answer among equally near points only.
  Hit Closest(const Eigen::Vector3d& query, int hint_face = -1) const;

  const Eigen::Vector3d& Min() const;
  const Eigen::Vector3d& Max() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace holdfast
