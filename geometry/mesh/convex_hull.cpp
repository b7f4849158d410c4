// SPDX-License-Identifier: MIT
#include "geometry/mesh/convex_hull.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <vector>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/convex_hull_3.h>

namespace holdfast {
namespace {

using HullPoint = CGAL::Exact_predicates_inexact_constructions_kernel::Point_3;

using Place = std::array<double, 3>;

Place PlaceOf(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }

// CGAL's. Its order, and which of the diagonals of a flat polygon it takes, depend on where its
// parts lie in memory.
TriangleMesh Hull(const Eigen::Matrix3Xd& points) {
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
  return out;
}

}  // namespace

TriangleMesh ConvexHull(const Eigen::Matrix3Xd& points) {
  const TriangleMesh hull = Hull(points);
  if (!(SignedVolume(hull) > 0.0)) return {};
  const Eigen::Matrix3Xd corners = DistinctPoints(hull.vertices);
  const double size = (corners.rowwise().maxCoeff() - corners.rowwise().minCoeff()).maxCoeff();
  const Eigen::Matrix3Xd jittered = Jittered(corners, 1e-10 * size);
  const TriangleMesh general = Hull(jittered);
  std::map<Place, int> corner_at;
  for (Eigen::Index i = 0; i < jittered.cols(); ++i) {
    corner_at[PlaceOf(jittered.col(i))] = static_cast<int>(i);
  }
  std::vector<int> kept;  // of the corners, those of `general`
  for (const auto v : general.vertices.colwise()) kept.push_back(corner_at.at(PlaceOf(v)));
  std::vector<int> order = kept;
  std::ranges::sort(order);
  std::vector<std::array<int, 3>> faces;
  for (const auto face : general.faces.colwise()) {
    std::array<int, 3> ids;
    for (int k = 0; k < 3; ++k) {
      ids[k] = static_cast<int>(std::ranges::lower_bound(order, kept[face[k]]) - order.begin());
    }
    std::rotate(ids.begin(), std::ranges::min_element(ids), ids.end());
    faces.push_back(ids);
  }
  std::ranges::sort(faces);
  TriangleMesh out{corners(Eigen::all, order), Eigen::Matrix3Xi(3, faces.size())};
  for (std::size_t f = 0; f < faces.size(); ++f) {
    out.faces.col(static_cast<Eigen::Index>(f)) = Eigen::Vector3i(faces[f].data());
  }
  return out;
}

Eigen::Matrix3Xd DistinctPoints(const Eigen::Matrix3Xd& points) {
  std::set<Place> places;
  for (const auto point : points.colwise()) places.insert(PlaceOf(point));
  Eigen::Matrix3Xd out(3, places.size());
  Eigen::Index i = 0;
  for (const Place& place : places) out.col(i++) = Eigen::Vector3d(place.data());
  return out;
}

Eigen::Matrix3Xd Jittered(const Eigen::Matrix3Xd& points, double size_m) {
  const auto part_of_one = [](double x) { return x - std::floor(x); };
  Eigen::Matrix3Xd out = points;
  for (Eigen::Index i = 0; i < out.cols(); ++i) {
    const auto k = static_cast<double>(i + 1);
    out.col(i) +=
        size_m * Eigen::Vector3d(part_of_one(0.8191725134 * k), part_of_one(0.6710436067 * k),
                                 part_of_one(0.5497004779 * k));
  }
  return out;
}

}  // namespace holdfast
