// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Signed solid angle of a triangle seen from the origin, steradians (Van Oosterom & Strackee
/// 1983): positive when the origin looks at its back.
double SolidAngle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c);

/// Triangles that close a soup: on every edge that its faces run through more often one way than
/// the other, vertices at one place being one, to the middle of the loop that the edge is of. Faces
/// without area are passed over. Empty where nothing is open.
TriangleMesh ClosingTriangles(const TriangleMesh& mesh);

/// Generalized winding number of a triangle soup (Jacobson et al. 2013): 1 inside and 0 outside of
/// a closed surface, in between around holes. Groups of faces that are far away are summed by the
/// first two terms of their expansion (Barill et al. 2018), so that a point costs O(log F); the
/// error is about 0.01, far from the threshold 1/2 it is compared with.
class WindingNumber {
 public:
  /// Throws nothing; faces without area add nothing.
  explicit WindingNumber(const TriangleMesh& mesh);

  double At(const Eigen::Vector3d& point) const;

  /// How often the ray from `from` along an axis (0 to 2), or against it, leaves through the faces
  /// less how often it enters: of a soup that is closed (ClosingTriangles), its winding number
  /// there. Faces that share an edge share its rounding: no ray slips through between them, and
  /// none meets both.
  int Crossings(const Eigen::Vector3d& from, int axis, bool ascending) const;

 private:
  struct Node {
    Eigen::Vector3d center;  // area-weighted mean of the faces' centroids
    Eigen::Vector3d dipole;  // sum of the faces' area vectors
    Eigen::Matrix3d moment;  // sum of area vector x (centroid - center)^T
    double radius = 0.0;     // of the ball around `center` that holds all corners
    int begin = 0, end = 0;  // faces
    int right = 0;           // right child; the left one follows its parent; 0: a leaf
  };
  int Build(int begin, int end, std::vector<int>& order, const Eigen::Matrix3Xd& centroids,
            const Eigen::Matrix3Xd& area_vectors);

  std::vector<Node> nodes_;
  Eigen::Matrix3Xd corners_;  // three columns per face, in tree order
};

}  // namespace holdfast
