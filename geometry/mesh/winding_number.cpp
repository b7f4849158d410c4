// SPDX-License-Identifier: MIT
#include "geometry/mesh/winding_number.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include <Eigen/Geometry>

namespace holdfast {
namespace {

constexpr int kLeafFaces = 8;
// A group is far when it is seen from more than this many of its radii.
constexpr double kFarRadii = 2.5;

}  // namespace

double SolidAngle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const double la = a.norm();
  const double lb = b.norm();
  const double lc = c.norm();
  return 2.0 * std::atan2(a.dot(b.cross(c)),
                          la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
}

WindingNumber::WindingNumber(const TriangleMesh& mesh) {
  const int num_faces = static_cast<int>(mesh.NumFaces());
  if (num_faces == 0) return;
  Eigen::Matrix3Xd centroids(3, num_faces);
  Eigen::Matrix3Xd area_vectors(3, num_faces);
  corners_.resize(3, 3 * num_faces);
  for (int f = 0; f < num_faces; ++f) {
    const Eigen::Vector3d a = mesh.vertices.col(mesh.faces(0, f));
    const Eigen::Vector3d b = mesh.vertices.col(mesh.faces(1, f));
    const Eigen::Vector3d c = mesh.vertices.col(mesh.faces(2, f));
    centroids.col(f) = (a + b + c) / 3.0;
    area_vectors.col(f) = 0.5 * (b - a).cross(c - a);
    corners_.col(3 * f) = a;
    corners_.col(3 * f + 1) = b;
    corners_.col(3 * f + 2) = c;
  }
  std::vector<int> order(num_faces);
  std::iota(order.begin(), order.end(), 0);
  nodes_.reserve(2 * num_faces / (kLeafFaces / 2) + 1);
  Build(0, num_faces, order, centroids, area_vectors);

  Eigen::Matrix3Xd sorted(3, corners_.cols());
  for (int i = 0; i < num_faces; ++i) {
    sorted.middleCols<3>(3 * i) = corners_.middleCols<3>(3 * order[i]);
  }
  corners_ = std::move(sorted);
}

int WindingNumber::Build(int begin, int end, std::vector<int>& order,
                         const Eigen::Matrix3Xd& centroids, const Eigen::Matrix3Xd& area_vectors) {
  const int id = static_cast<int>(nodes_.size());
  Node node;
  node.begin = begin;
  node.end = end;
  node.center.setZero();
  node.dipole.setZero();
  double area = 0.0;
  Eigen::Vector3d low = centroids.col(order[begin]);
  Eigen::Vector3d high = low;
  for (int i = begin; i < end; ++i) {
    const int f = order[i];
    const double face_area = area_vectors.col(f).norm();
    area += face_area;
    node.center += face_area * centroids.col(f);
    node.dipole += area_vectors.col(f);
    low = low.cwiseMin(centroids.col(f));
    high = high.cwiseMax(centroids.col(f));
  }
  node.center =
      area > 0.0 ? Eigen::Vector3d(node.center / area) : Eigen::Vector3d(0.5 * (low + high));
  node.moment.setZero();
  for (int i = begin; i < end; ++i) {
    const int f = order[i];
    node.moment += area_vectors.col(f) * (centroids.col(f) - node.center).transpose();
    for (int k = 0; k < 3; ++k) {
      node.radius = std::max(node.radius, (corners_.col(3 * f + k) - node.center).norm());
    }
  }
  nodes_.push_back(node);
  if (end - begin <= kLeafFaces) return id;

  Eigen::Index axis = 0;
  (high - low).maxCoeff(&axis);
  const int middle = begin + (end - begin) / 2;
  // Ids break ties, so that the tree is the same everywhere.
  std::nth_element(order.begin() + begin, order.begin() + middle, order.begin() + end,
                   [&](int f, int g) {
                     return std::pair(centroids(axis, f), f) < std::pair(centroids(axis, g), g);
                   });
  Build(begin, middle, order, centroids, area_vectors);
  nodes_[id].right = Build(middle, end, order, centroids, area_vectors);
  return id;
}

double WindingNumber::At(const Eigen::Vector3d& point) const {
  if (nodes_.empty()) return 0.0;
  double angle = 0.0;
  std::array<int, 64> stack;  // the tree halves at every level
  int size = 0;
  stack[size++] = 0;
  while (size > 0) {
    const int id = stack[--size];
    const Node& node = nodes_[id];
    const Eigen::Vector3d offset = node.center - point;
    const double distance = offset.norm();
    if (distance > kFarRadii * node.radius) {
      const double inverse = 1.0 / distance;
      const Eigen::Vector3d direction = inverse * offset;
      angle += inverse * inverse *
               (node.dipole.dot(direction) +
                inverse * (node.moment.trace() - 3.0 * direction.dot(node.moment * direction)));
    } else if (node.right == 0) {
      for (int i = node.begin; i < node.end; ++i) {
        angle += SolidAngle(corners_.col(3 * i) - point, corners_.col(3 * i + 1) - point,
                            corners_.col(3 * i + 2) - point);
      }
    } else {
      stack[size++] = node.right;
      stack[size++] = id + 1;
    }
  }
  return angle / (4.0 * std::numbers::pi);
}

}  // namespace holdfast
