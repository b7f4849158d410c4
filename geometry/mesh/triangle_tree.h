// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <vector>

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

/// Nearest point on a triangle soup, by a tree of axis-aligned boxes, eight to a node: boxes in
/// single precision rounded outwards leave triangles out, what is left is measured in double
/// precision. Queries are const and may run on any number of threads.
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

  /// The same faces with their vertices elsewhere: boxes are fitted anew, in a small part of the
  /// time that a new tree takes. Faces left out stay left out.
  void Move(const TriangleMesh& mesh);

  /// The nearest point; of equally near faces the first. `hint_face` (a face of a nearby query's
  /// hit) shortens the search and changes nothing else.
  Hit Closest(const Eigen::Vector3d& query, int hint_face = -1) const;

  /// Faces whose boxes reach into the box [low, high], ascending; some within rounding of it.
  std::vector<int> FacesInBox(const Eigen::Vector3d& low, const Eigen::Vector3d& high) const;

  const Eigen::Vector3d& Min() const;
  const Eigen::Vector3d& Max() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace holdfast
