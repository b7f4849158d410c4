// SPDX-License-Identifier: MIT
#include "geometry/mesh/winding_number.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <numeric>
#include <utility>

#include <Eigen/Geometry>

#include "geometry/mesh/mesh_parts.h"
#include "geometry/mesh/mesh_topology.h"

namespace holdfast {
namespace {

constexpr int kLeafFaces = 8;
// A group of faces is far if its distance exceeds this many of its radii.
constexpr double kFarRadii = 2.5;

// Returns the side of the directed line from a to b on which p lies, seen along an axis: 1 left, -1
// right. On the line, returns the side of a point slightly farther along u, then v; 0 if a and b
// coincide in this view. Antisymmetric in a and b, whether or not contracted to fma.
int SideOf(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b, int u,
           int v) {
  const bool swapped = std::pair(b[u], b[v]) < std::pair(a[u], a[v]);
  const Eigen::Vector3d& from = swapped ? b : a;
  const Eigen::Vector3d& to = swapped ? a : b;
  const double left = (from[u] - p[u]) * (to[v] - p[v]) - (from[v] - p[v]) * (to[u] - p[u]);
  const int sign = left != 0.0        ? (left > 0.0 ? 1 : -1)
                   : from[v] != to[v] ? (from[v] > to[v] ? 1 : -1)
                   : from[u] != to[u] ? (to[u] > from[u] ? 1 : -1)
                                      : 0;
  return swapped ? -sign : sign;
}

}  // namespace

double SolidAngle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const double la = a.norm();
  const double lb = b.norm();
  const double lc = c.norm();
  return 2.0 * std::atan2(a.dot(b.cross(c)),
                          la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
}

TriangleMesh ClosingTriangles(const TriangleMesh& mesh) {
  const std::vector<int> place = FirstAtSamePlace(mesh.vertices);
  struct Side {
    int low, high, way;
  };
  std::vector<Side> sides;
  sides.reserve(static_cast<std::size_t>(mesh.faces.size()));
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    if (!(FaceCross(mesh, f).squaredNorm() > 0.0)) continue;
    for (int k = 0; k < 3; ++k) {
      const int a = place[mesh.faces(k, f)], b = place[mesh.faces((k + 1) % 3, f)];
      sides.push_back(a < b ? Side{a, b, 1} : Side{b, a, -1});
    }
  }
  std::ranges::sort(sides, {}, [](const Side& side) { return std::pair(side.low, side.high); });
  std::vector<Side> open;  // `way`: signed number of traversals
  DisjointSets loops(static_cast<int>(mesh.NumVertices()));
  for (std::size_t i = 0, end = i; i < sides.size(); i = end) {
    Side edge{sides[i].low, sides[i].high, 0};
    for (; end < sides.size() && sides[end].low == edge.low && sides[end].high == edge.high;
         ++end) {
      edge.way += sides[end].way;
    }
    if (edge.way == 0) continue;
    open.push_back(edge);
    loops.Merge(edge.low, edge.high);
  }
  // Vertices of the mesh, then the loop centroids, each the mean of its edges' ends.
  TriangleMesh closing;
  std::vector<int> middle_of(static_cast<std::size_t>(mesh.NumVertices()), -1);
  std::vector<Eigen::Vector4d> sums;
  for (const Side& edge : open) {
    int& middle = middle_of[loops.Find(edge.low)];
    if (middle < 0) {
      middle = static_cast<int>(sums.size());
      sums.push_back(Eigen::Vector4d::Zero());
    }
    sums[middle] += (mesh.vertices.col(edge.low) + mesh.vertices.col(edge.high)).homogeneous();
  }
  const Eigen::Index first_middle = mesh.NumVertices();
  closing.vertices.resize(3, first_middle + static_cast<Eigen::Index>(sums.size()));
  closing.vertices.leftCols(first_middle) = mesh.vertices;
  for (std::size_t m = 0; m < sums.size(); ++m) {
    closing.vertices.col(first_middle + static_cast<Eigen::Index>(m)) = 0.5 * sums[m].hnormalized();
  }
  std::vector<int> corners;
  for (const Side& edge : open) {
    const int middle = static_cast<int>(first_middle) + middle_of[loops.Find(edge.low)];
    for (int n = 0; n < std::abs(edge.way); ++n) {
      const bool ascending = edge.way > 0;
      corners.insert(corners.end(),
                     {ascending ? edge.high : edge.low, ascending ? edge.low : edge.high, middle});
    }
  }
  closing.faces = Eigen::Map<const Eigen::Matrix3Xi>(corners.data(), 3,
                                                     static_cast<Eigen::Index>(corners.size() / 3));
  return closing;
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
  // Ids break ties, so that the tree is the same on all platforms.
  std::nth_element(order.begin() + begin, order.begin() + middle, order.begin() + end,
                   [&](int f, int g) {
                     return std::pair(centroids(axis, f), f) < std::pair(centroids(axis, g), g);
                   });
  Build(begin, middle, order, centroids, area_vectors);
  nodes_[id].right = Build(middle, end, order, centroids, area_vectors);
  return id;
}

int WindingNumber::Crossings(const Eigen::Vector3d& from, int axis, bool ascending) const {
  if (nodes_.empty()) return 0;
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  int count = 0;
  std::array<int, 64> stack;  // the tree halves at every level
  int size = 0;
  stack[size++] = 0;
  while (size > 0) {
    const int id = stack[--size];
    const Node& node = nodes_[id];
    const Eigen::Vector3d offset = node.center - from;
    const double ahead = (ascending ? offset[axis] : -offset[axis]) + node.radius;
    const double radius = (1.0 + 1e-9) * node.radius;  // no corner is lost to rounding
    const double aside = offset[u] * offset[u] + offset[v] * offset[v];
    if (ahead < -1e-9 * node.radius || aside > radius * radius) continue;
    if (node.right != 0) {
      stack[size++] = node.right;
      stack[size++] = id + 1;
      continue;
    }
    for (int i = node.begin; i < node.end; ++i) {
      const Eigen::Vector3d a = corners_.col(3 * i), b = corners_.col(3 * i + 1),
                            c = corners_.col(3 * i + 2);
      const int side = SideOf(from, a, b, u, v);
      if (side == 0 || SideOf(from, b, c, u, v) != side || SideOf(from, c, a, u, v) != side)
        continue;
      const Eigen::Vector3d normal = (b - a).cross(c - a);
      const double beyond = normal.dot(a - from) * normal[axis];  // sign relative to the axis
      if (ascending ? beyond > 0.0 : beyond < 0.0) count += ascending ? side : -side;
    }
  }
  return count;
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
