// SPDX-License-Identifier: MIT
#pragma once

#include <memory>

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"
#include "geometry/mesh/triangle_tree.h"

namespace holdfast {

/// Exact signed distance to a triangle mesh: negative inside. Closest points come from a tree of
/// bounding boxes. The sign of a watertight mesh comes from the angle-weighted pseudonormal of the
/// face, edge or vertex the closest point lies on (Baerentzen & Aanaes 2005); that of any other
/// mesh from the generalized winding number (Jacobson et al. 2013), which is > 1/2 inside and
/// degrades gracefully across holes: a ray's crossings less the part of what would close the holes.
///
/// Queries are const and may run on any number of threads.
class SignedDistance {
 public:
  enum class Sign {
    kPseudonormal,   ///< the mesh is watertight
    kWindingNumber,  ///< it is not: inside is where the winding number exceeds 1/2
  };

  struct Result {
    double distance = 0.0;     ///< meters, negative inside
    Eigen::Vector3d closest;   ///< on the surface
    Eigen::Vector3d gradient;  ///< of the distance, unit; the pseudonormal on the surface itself
    int face = -1;             ///< a face that holds `closest`
  };

  /// Copies what it needs. Throws Error for a mesh without a face of positive area, ids out of
  /// range or coordinates that are not finite. Faces without area are ignored.
  explicit SignedDistance(const TriangleMesh& mesh);
  ~SignedDistance();
  SignedDistance(SignedDistance&&) noexcept;
  SignedDistance& operator=(SignedDistance&&) noexcept;

  Sign SignMethod() const;

  /// The same faces with their vertices (3 x V) elsewhere, as a hand's from frame to frame, in a
  /// small part of the time that a new one takes. What was watertight is taken to stay so. Throws
  /// Error for another number of vertices.
  void Move(const Eigen::Matrix3Xd& vertices);

  double Distance(const Eigen::Vector3d& point) const;
  /// `hint_face`: as TriangleTree::Closest's, for speed alone.
  Result Query(const Eigen::Vector3d& point, int hint_face = -1) const;
  /// Whether a point is strictly inside.
  bool Inside(const Eigen::Vector3d& point) const { return Distance(point) < 0.0; }
  /// The same with what Tree() found to be nearest to it.
  bool Inside(const Eigen::Vector3d& point, const TriangleTree::Hit& nearest) const;
  /// How far a point at `distance` from the surface can move and stay on the same side of it,
  /// meters, at least; less than `distance` around the holes of an open surface.
  double SideHolds(const Eigen::Vector3d& point, double distance) const;

  /// Distance of each column of `points` on up to `threads` threads; the same bytes for any number.
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
