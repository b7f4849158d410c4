// SPDX-License-Identifier: MIT
#include "geometry/mesh/triangle_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Geometry>

// The names of CGAL 5.5, which 6 has still.
#define CGAL_NO_DEPRECATION_WARNINGS
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>

#include "geometry/error.h"

namespace holdfast {
namespace {

// Doubles suffice: nothing here decides topology, and an error of an ulp moves the closest point by
// as much.
using Kernel = CGAL::Simple_cartesian<double>;
using Point = Kernel::Point_3;
using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

Point ToCgal(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }
Eigen::Vector3d ToEigen(const Point& p) { return {p.x(), p.y(), p.z()}; }

// CGAL starts its search for a closest triangle at the nearest first corner. Its tree of these is
// as deep as there are many at one place, and is built by recursion: where a fan has more triangles
// than that can take, these are the corners with one triangle each. Empty: no such fan.
std::vector<Tree::Point_and_primitive_id> StartsWithoutHubs(const Triangles& triangles) {
  constexpr std::size_t kMostAtOnePlace = 1000;
  std::vector<Tree::Point_and_primitive_id> starts;
  starts.reserve(triangles.size());
  for (auto t = triangles.cbegin(); t != triangles.cend(); ++t) starts.emplace_back((*t)[0], t);
  std::sort(starts.begin(), starts.end());
  std::size_t longest = 0, begin = 0;
  for (std::size_t i = 0; i < starts.size(); ++i) {
    if (starts[i].first != starts[begin].first) begin = i;
    longest = std::max(longest, i + 1 - begin);
  }
  if (longest <= kMostAtOnePlace) return {};
  const auto same = [](const auto& a, const auto& b) { return a.first == b.first; };
  starts.erase(std::unique(starts.begin(), starts.end(), same), starts.end());
  return starts;
}

}  // namespace

TrianglePoint ClosestOnTriangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  using enum TriangleFeature;
  const Eigen::Vector3d ab = b - a;
  const Eigen::Vector3d ac = c - a;
  const Eigen::Vector3d ap = p - a;
  const double d1 = ab.dot(ap);
  const double d2 = ac.dot(ap);
  if (d1 <= 0.0 && d2 <= 0.0) return {a, kVertex0};

  const Eigen::Vector3d bp = p - b;
  const double d3 = ab.dot(bp);
  const double d4 = ac.dot(bp);
  if (d3 >= 0.0 && d4 <= d3) return {b, kVertex1};

  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return {a + d1 / (d1 - d3) * ab, kEdge01};

  const Eigen::Vector3d cp = p - c;
  const double d5 = ab.dot(cp);
  const double d6 = ac.dot(cp);
  if (d6 >= 0.0 && d5 <= d6) return {c, kVertex2};

  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return {a + d2 / (d2 - d6) * ac, kEdge20};

  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
    return {b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b), kEdge12};
  }
  const double scale = 1.0 / (va + vb + vc);
  return {a + vb * scale * ab + vc * scale * ac, kFace};
}

struct TriangleTree::Impl {
  Triangles triangles;     // never moved once the tree points into it
  std::vector<int> faces;  // mesh face of each triangle
  std::vector<int> triangle_of_face;
  Tree tree;
  Eigen::Vector3d min, max;
};

TriangleTree::TriangleTree(const TriangleMesh& mesh) : impl_(std::make_unique<Impl>()) {
  if (!mesh.vertices.allFinite()) {
    throw Error("mesh", "has coordinates that are not finite", "Repair the mesh first.");
  }
  impl_->triangles.reserve(mesh.NumFaces());
  impl_->faces.reserve(mesh.NumFaces());
  impl_->triangle_of_face.assign(mesh.NumFaces(), -1);
  impl_->min.setConstant(std::numeric_limits<double>::infinity());
  impl_->max = -impl_->min;
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    const Eigen::Vector3i face = mesh.faces.col(f);
    if (face.minCoeff() < 0 || face.maxCoeff() >= mesh.NumVertices()) {
      throw Error("mesh", "has faces with vertex ids out of range", "Repair the mesh first.");
    }
    const Eigen::Vector3d a = mesh.vertices.col(face[0]);
    const Eigen::Vector3d b = mesh.vertices.col(face[1]);
    const Eigen::Vector3d c = mesh.vertices.col(face[2]);
    if (!((b - a).cross(c - a).squaredNorm() > 0.0)) continue;
    impl_->triangle_of_face[f] = static_cast<int>(impl_->triangles.size());
    impl_->triangles.emplace_back(ToCgal(a), ToCgal(b), ToCgal(c));
    impl_->faces.push_back(static_cast<int>(f));
    impl_->min = impl_->min.cwiseMin(a).cwiseMin(b).cwiseMin(c);
    impl_->max = impl_->max.cwiseMax(a).cwiseMax(b).cwiseMax(c);
  }
  if (impl_->triangles.empty()) {
    throw Error("mesh", "has no face with an area", "Give a surface, not a set of points.");
  }
  impl_->tree.insert(impl_->triangles.cbegin(), impl_->triangles.cend());
  // Both are lazy otherwise, and queries come from several threads.
  impl_->tree.build();
  const std::vector<Tree::Point_and_primitive_id> starts = StartsWithoutHubs(impl_->triangles);
  if (starts.empty()) {
    impl_->tree.accelerate_distance_queries();
  } else {
    impl_->tree.accelerate_distance_queries(starts.begin(), starts.end());
  }
}

TriangleTree::~TriangleTree() = default;
TriangleTree::TriangleTree(TriangleTree&&) noexcept = default;
TriangleTree& TriangleTree::operator=(TriangleTree&&) noexcept = default;

TriangleTree::Hit TriangleTree::Closest(const Eigen::Vector3d& query, int hint_face) const {
  const Point point = ToCgal(query);
  Tree::Point_and_primitive_id nearest;
  if (hint_face >= 0 && impl_->triangle_of_face[hint_face] >= 0) {
    const auto triangle = impl_->triangles.cbegin() + impl_->triangle_of_face[hint_face];
    const Eigen::Vector3d start =
        ClosestOnTriangle(query, ToEigen((*triangle)[0]), ToEigen((*triangle)[1]),
                          ToEigen((*triangle)[2]))
            .point;
    nearest = impl_->tree.closest_point_and_primitive(point, {ToCgal(start), triangle});
  } else {
    nearest = impl_->tree.closest_point_and_primitive(point);
  }
  const auto triangle = nearest.second;
  const TrianglePoint on_triangle = ClosestOnTriangle(
      query, ToEigen((*triangle)[0]), ToEigen((*triangle)[1]), ToEigen((*triangle)[2]));
  return {on_triangle.point, on_triangle.feature,
          impl_->faces[triangle - impl_->triangles.cbegin()],
          (query - on_triangle.point).squaredNorm()};
}

const Eigen::Vector3d& TriangleTree::Min() const { return impl_->min; }
const Eigen::Vector3d& TriangleTree::Max() const { return impl_->max; }

}  // namespace holdfast
