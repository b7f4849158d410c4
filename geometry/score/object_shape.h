// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// First and second moments of a surface, by its area: defined for open meshes as well.
struct SurfaceMoments {
  double area_m2 = 0.0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();      ///< mean point, metres
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< about the centre, m^2
};

/// Exact integrals over the triangles. Throws Error for a mesh without area.
SurfaceMoments MeasureMoments(const TriangleMesh& mesh);

/// Greatest distance between two vertices, metres.
double Diameter(const Eigen::Matrix3Xd& vertices);

}  // namespace holdfast
