// SPDX-License-Identifier: MIT
#include "geometry/score/object_shape.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include <Eigen/Geometry>

#include "geometry/error.h"

namespace holdfast {

SurfaceMoments MeasureMoments(const TriangleMesh& mesh) {
  SurfaceMoments moments;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  if (mesh.NumVertices() == 0) throw Error("mesh", "has no vertices", "Give a surface");
  const Eigen::Vector3d origin = mesh.vertices.col(0);
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    Eigen::Matrix3d p;
    for (int k = 0; k < 3; ++k) p.col(k) = mesh.vertices.col(mesh.faces(k, f)) - origin;
    const double area = 0.5 * (p.col(1) - p.col(0)).cross(p.col(2) - p.col(0)).norm();
    const Eigen::Vector3d sum = p.rowwise().sum();
    moments.area_m2 += area;
    first += area / 3.0 * sum;
    second += area / 12.0 * (p * p.transpose() + sum * sum.transpose());
  }
  if (!(moments.area_m2 > 0.0)) throw Error("mesh", "has no area", "Give a surface");
  const Eigen::Vector3d mean = first / moments.area_m2;
  moments.center = origin + mean;
  moments.covariance = second / moments.area_m2 - mean * mean.transpose();
  return moments;
}

double Diameter(const Eigen::Matrix3Xd& vertices) {
  const Eigen::Index n = vertices.cols();
  if (n < 2) return 0.0;
  // Farthest from the middle first: a pair's distance is at most the sum of its radii, so most
  // pairs of an elongated object are never looked at.
  const Eigen::Vector3d middle =
      0.5 * (vertices.rowwise().minCoeff() + vertices.rowwise().maxCoeff());
  const Eigen::VectorXd radius = (vertices.colwise() - middle).colwise().norm().transpose();
  std::vector<int> order(static_cast<std::size_t>(n));
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    return radius[a] > radius[b] || (radius[a] == radius[b] && a < b);
  });
  double squared = 0.0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Eigen::Vector3d a = vertices.col(order[i]);
    for (std::size_t j = i + 1; j < order.size(); ++j) {
      const double reach = radius[order[i]] + radius[order[j]];
      if (reach * reach <= squared) break;
      squared = std::max(squared, (vertices.col(order[j]) - a).squaredNorm());
    }
  }
  return std::sqrt(squared);
}

}  // namespace holdfast
