// SPDX-License-Identifier: MIT
#include "geometry/mesh/convex_hull.h"

#include <vector>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/convex_hull_3.h>

namespace holdfast {
namespace {

using HullPoint = CGAL::Exact_predicates_inexact_constructions_kernel::Point_3;

}  // namespace

TriangleMesh ConvexHull(const Eigen::Matrix3Xd& points) {
  std::vector<HullPoint> corners;
  for (const auto p : points.colwise()) corners.emplace_back(p.x(), p.y(), p.z());
  CGAL::Surface_mesh<HullPoint> hull;
  CGAL::convex_hull_3(corners.begin(), corners.end(), hull);
  TriangleMesh out;
  // Of points in a plane it is one polygon.
  if (hull.number_of_faces() + 4 != 2 * hull.number_of_vertices()) return out;
  out.vertices.resize(3, hull.number_of_vertices());
  out.faces.resize(3, hull.number_of_faces());
  for (const auto v : hull.vertices()) {
    const HullPoint& p = hull.point(v);
    out.vertices.col(v.idx()) << p.x(), p.y(), p.z();
  }
  for (const auto f : hull.faces()) {
    int k = 0;
    for (const auto v : hull.vertices_around_face(hull.halfedge(f))) {
      out.faces(k++, f.idx()) = static_cast<int>(v.idx());
    }
  }
  return SignedVolume(out) > 0.0 ? out : TriangleMesh();
}

}  // namespace holdfast
