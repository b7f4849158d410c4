// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/mesh/mesh.h"
#include "geometry/mesh/signed_distance.h"
#include "geometry/mesh/surface_distance.h"

namespace holdfast {

/// Points of a surface with their outward normals.
struct OrientedPoints {
  Eigen::Matrix3Xd at, normal;
  Eigen::Index Count() const { return at.cols(); }
};
/// `count` points, evenly over the mesh; `surface` is its distance.
inline OrientedPoints SampleOriented(const TriangleMesh& mesh, const SignedDistance& surface,
                                     int count) {
  OrientedPoints points{SampleSurface(mesh, count), {}};
  points.normal.resize(3, points.at.cols());
  for (Eigen::Index i = 0; i < points.at.cols(); ++i) {
    points.normal.col(i) = surface.Query(points.at.col(i)).gradient;
  }
  return points;
}

inline Eigen::AlignedBox3d BoxOf(const Eigen::Matrix3Xd& points) {
  return {points.rowwise().minCoeff(), points.rowwise().maxCoeff()};
}

}  // namespace holdfast
