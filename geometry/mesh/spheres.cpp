// SPDX-License-Identifier: MIT
#include "geometry/mesh/spheres.h"

#include <vector>

namespace holdfast {

TriangleMesh Spheres(const Eigen::Matrix3Xd& points, double radius_m, int steps) {
  std::vector<Eigen::Vector3d> corners;  // of a unit sphere
  std::vector<Eigen::Vector3i> faces;
  for (int octant = 0; octant < 8; ++octant) {
    const Eigen::Vector3d signs(octant & 1 ? -1 : 1, octant & 2 ? -1 : 1, octant & 4 ? -1 : 1);
    const bool mirrored = signs.prod() < 0.0;
    const auto add = [&](int i, int j) {
      corners.push_back(signs.cwiseProduct(Eigen::Vector3d(i, j, steps - i - j)).normalized());
      return static_cast<int>(corners.size()) - 1;
    };
    const auto face = [&](int a, int b, int c) {
      faces.emplace_back(a, mirrored ? c : b, mirrored ? b : c);
    };
    for (int i = 0; i < steps; ++i) {
      for (int j = 0; i + j < steps; ++j) {
        face(add(i + 1, j), add(i, j + 1), add(i, j));
        if (i + j + 1 < steps) face(add(i + 1, j), add(i + 1, j + 1), add(i, j + 1));
      }
    }
  }
  const auto n = static_cast<Eigen::Index>(corners.size()),
             m = static_cast<Eigen::Index>(faces.size());
  TriangleMesh spheres;
  spheres.vertices.resize(3, n * points.cols());
  spheres.faces.resize(3, m * points.cols());
  Eigen::Index count = 0;
  for (const auto point : points.colwise()) {
    if (!point.allFinite()) continue;
    for (Eigen::Index i = 0; i < n; ++i) {
      spheres.vertices.col(count * n + i) = point + radius_m * corners[i];
    }
    for (Eigen::Index f = 0; f < m; ++f) {
      spheres.faces.col(count * m + f) = faces[f].array() + static_cast<int>(count * n);
    }
    ++count;
  }
  spheres.vertices.conservativeResize(3, count * n);
  spheres.faces.conservativeResize(3, count * m);
  return spheres;
}

}  // namespace holdfast
