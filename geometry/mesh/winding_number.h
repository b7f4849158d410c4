// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Signed solid angle of a triangle seen from the origin, steradians (Van Oosterom & Strackee
/// 1983); positive if the origin sees the back of the triangle.
double SolidAngle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c);

/// Returns triangles that close the holes of a triangle soup: one for each boundary edge (traversed
/// more often in one direction), to the centroid of its boundary loop. Vertices at the same
/// position count as one; faces without area are ignored. Empty if the soup is closed.
TriangleMesh ClosingTriangles(const TriangleMesh& mesh);

/// Generalized winding number of a triangle soup (Jacobson et al. 2013): 1 inside and 0 outside of
/// a closed surface, in between near holes. Distant groups of faces are summed by the first two
/// terms of their expansion (Barill et al. 2018), so that a query costs O(log F). The error is
/// about 0.01, small compared with the decision threshold of 1/2.
class WindingNumber {
 public:
  /// Does not throw; faces without area contribute nothing.
  explicit WindingNumber(const TriangleMesh& mesh);

  double At(const Eigen::Vector3d& point) const;

  /// Counts how often the ray from `from` along an axis (0 to 2), or against it, leaves through the
  /// faces minus how often it enters. For a closed soup (ClosingTriangles) this is the winding
  /// number. Faces with a common edge are rounded identically, so that no ray passes between them
  /// or hits both.
  int Crossings(const Eigen::Vector3d& from, int axis, bool ascending) const;

 private:
  struct Node {
    Eigen::Vector3d center;  // area-weighted mean of the faces' centroids
    Eigen::Vector3d dipole;  // sum of the faces' area vectors
    Eigen::Matrix3d moment;  // sum of area vector x (centroid - center)^T
    double radius = 0.0;     // of the ball around `center` that contains all corners
    int begin = 0, end = 0;  // faces
    int right = 0;           // right child; 0 for a leaf; the left child follows its parent
  };
  int Build(int begin, int end, std::vector<int>& order, const Eigen::Matrix3Xd& centroids,
            const Eigen::Matrix3Xd& area_vectors);

  std::vector<Node> nodes_;
  Eigen::Matrix3Xd corners_;  // three columns per face, in tree order
};

}  // namespace holdfast
