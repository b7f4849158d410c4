// SPDX-License-Identifier: MIT
#pragma once

#include <memory>

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"
#include "geometry/mesh/triangle_tree.h"

namespace holdfast {

/// Exact signed distance to a triangle mesh, negative inside. Closest points come from a tree of
/// bounding boxes. For a watertight mesh the sign comes from the angle-weighted pseudonormal at the
/// closest face, edge or vertex (Baerentzen & Aanaes 2005). For any other mesh it comes from the
/// generalized winding number (Jacobson et al. 2013), which is > 1/2 inside and degrades gracefully
/// across holes. It is computed as ray crossings minus the contribution of the closing triangles.
///
/// Queries are const and may run on any number of threads.
class SignedDistance {
 public:
  struct Result {
    double distance = 0.0;     ///< meters, negative inside
    Eigen::Vector3d closest;   ///< on the surface
    Eigen::Vector3d gradient;  ///< of the distance, unit; on the surface itself the pseudonormal
    int face = -1;             ///< a face that contains `closest`
  };

  /// Copies the mesh data that it needs. Throws Error for a mesh without a face of positive area,
  /// ids out of range or coordinates that are not finite. Faces without area are ignored.
  explicit SignedDistance(const TriangleMesh& mesh);
  ~SignedDistance();
  SignedDistance(SignedDistance&&) noexcept;
  SignedDistance& operator=(SignedDistance&&) noexcept;

  /// Whether the sign comes from the pseudonormal, not from the winding number.
  bool IsWatertight() const;

  /// Moves the vertices (3 x V) of the same faces, e.g. of a hand from frame to frame, in a small
  /// fraction of the construction time. A watertight mesh is assumed to stay watertight. Throws
  /// Error for a different number of vertices.
  void Move(const Eigen::Matrix3Xd& vertices);

  double Distance(const Eigen::Vector3d& point) const;
  /// `hint_face` as in TriangleTree::Closest; it only affects speed.
  Result Query(const Eigen::Vector3d& point, int hint_face = -1) const;
  /// Whether a point is strictly inside.
  bool Inside(const Eigen::Vector3d& point) const { return Distance(point) < 0.0; }
  /// Whether a point is strictly inside, given its nearest hit from Tree().
  bool Inside(const Eigen::Vector3d& point, const TriangleTree::Hit& nearest) const;
  /// Lower bound (meters) on how far a point at `distance` from the surface can move while staying
  /// on the same side. Less than `distance` near the holes of an open surface.
  double SideHolds(const Eigen::Vector3d& point, double distance) const;

  /// Distance of each column of `points`; the result does not depend on the number of threads.
  Eigen::VectorXd Distances(const Eigen::Matrix3Xd& points, int threads = 1) const;

  const TriangleTree& Tree() const;

  /// Bounding box of the surface.
  const Eigen::Vector3d& Min() const;
  const Eigen::Vector3d& Max() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace holdfast
