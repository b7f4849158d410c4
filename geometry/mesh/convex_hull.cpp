// SPDX-License-Identifier: MIT
#include "geometry/mesh/convex_hull.h"

#include <algorithm>
#include <array>
#include <map>
#include <random>
#include <vector>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#ifndef HOLDFAST_WITHOUT_GPL
#include <CGAL/Surface_mesh.h>
#include <CGAL/convex_hull_3.h>
#endif

#include "geometry/error.h"

namespace holdfast {
namespace {

using HullPoint = CGAL::Exact_predicates_inexact_constructions_kernel::Point_3;

using Place = std::array<double, 3>;

Place PlaceOf(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }

#ifndef HOLDFAST_WITHOUT_GPL
// CGAL's convex hull. Its order, and the diagonals that it chooses in flat polygons, depend on
// memory addresses.
TriangleMesh Hull(const Eigen::Matrix3Xd& points) {
  std::vector<HullPoint> corners;
  for (const auto p : points.colwise()) corners.emplace_back(p.x(), p.y(), p.z());
  CGAL::Surface_mesh<HullPoint> hull;
  CGAL::convex_hull_3(corners.begin(), corners.end(), hull);
  TriangleMesh out;
  // For coplanar points the hull is a single polygon.
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
#else
TriangleMesh Hull(const Eigen::Matrix3Xd& /*points*/) {
  throw Error("this build of Holdfast", "has no convex hulls: it is without CGAL's GPL packages",
              "Build with HOLDFAST_GPL=ON");
}
#endif

HullPoint PointAt(const TriangleMesh& mesh, int vertex) {
  const auto p = mesh.vertices.col(vertex);
  return {p.x(), p.y(), p.z()};
}

bool InOnePlane(const TriangleMesh& mesh, int face, int other) {
  const auto at = [&](int f, int k) { return PointAt(mesh, mesh.faces(k, f)); };
  for (int k = 0; k < 3; ++k) {
    if (!CGAL::coplanar(at(face, 0), at(face, 1), at(face, 2), at(other, k))) return false;
  }
  return true;
}

// Vertices at which three or more planes meet. CGAL's hull has additional vertices exactly on
// straight edges or in flat faces; which ones depends on memory addresses.
Eigen::Matrix3Xd Corners(const TriangleMesh& hull) {
  std::vector<std::vector<int>> planes_at(static_cast<std::size_t>(hull.vertices.cols()));
  for (int f = 0; f < hull.faces.cols(); ++f) {
    const Eigen::Vector3i ids = hull.faces.col(f);
    if (CGAL::collinear(PointAt(hull, ids[0]), PointAt(hull, ids[1]), PointAt(hull, ids[2]))) {
      continue;
    }
    for (const int v : ids) {
      std::vector<int>& planes = planes_at[static_cast<std::size_t>(v)];
      const bool known =
          std::ranges::any_of(planes, [&](int other) { return InOnePlane(hull, other, f); });
      if (!known) planes.push_back(f);
    }
  }
  std::vector<int> corners;
  for (std::size_t v = 0; v < planes_at.size(); ++v) {
    if (planes_at[v].size() > 2) corners.push_back(static_cast<int>(v));
  }
  return DistinctPoints(hull.vertices(Eigen::all, corners));
}

// Used vertices and faces of CGAL's hull in a deterministic order. Vertex i of `hull` is `place[i]`
// in the sorted `corners`.
TriangleMesh Ordered(const TriangleMesh& hull, const std::vector<int>& place,
                     const Eigen::Matrix3Xd& corners) {
  std::vector<int> order = place;
  std::ranges::sort(order);
  std::vector<std::array<int, 3>> faces;
  for (const auto face : hull.faces.colwise()) {
    std::array<int, 3> ids;
    for (int k = 0; k < 3; ++k) {
      ids[k] = static_cast<int>(std::ranges::lower_bound(order, place[face[k]]) - order.begin());
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

// Indices of the vertices of `hull` among the points.
std::vector<int> PlacesOf(const TriangleMesh& hull, const Eigen::Matrix3Xd& points) {
  std::map<Place, int> at;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    at[PlaceOf(points.col(i))] = static_cast<int>(i);
  }
  std::vector<int> places;
  for (const auto v : hull.vertices.colwise()) places.push_back(at.at(PlaceOf(v)));
  return places;
}

}  // namespace

TriangleMesh ConvexHull(const Eigen::Matrix3Xd& points) {
  const TriangleMesh hull = Hull(points);
  if (!(SignedVolume(hull) > 0.0)) return {};
  const Eigen::Matrix3Xd corners = Corners(hull);
  const double size = (corners.rowwise().maxCoeff() - corners.rowwise().minCoeff()).maxCoeff();
  const Eigen::Matrix3Xd jittered = Jittered(corners, 1e-10 * size);
  const TriangleMesh general = Hull(jittered);
  return Ordered(general, PlacesOf(general, jittered), corners);
}

TriangleMesh ConvexHullOfJittered(const Eigen::Matrix3Xd& points) {
  const TriangleMesh hull = Hull(points);
  if (!(SignedVolume(hull) > 0.0)) return {};
  const Eigen::Matrix3Xd corners = DistinctPoints(hull.vertices);
  return Ordered(hull, PlacesOf(hull, corners), corners);
}

Eigen::Matrix3Xd DistinctPoints(const Eigen::Matrix3Xd& points) {
  std::vector<Place> places;
  places.reserve(static_cast<std::size_t>(points.cols()));
  for (const auto point : points.colwise()) places.push_back(PlaceOf(point));
  std::ranges::stable_sort(places);  // -0 and 0 are the same coordinate: the first one is kept
  places.erase(std::ranges::unique(places).begin(), places.end());
  Eigen::Matrix3Xd out(3, places.size());
  Eigen::Index i = 0;
  for (const Place& place : places) out.col(i++) = Eigen::Vector3d(place.data());
  return out;
}

Eigen::Matrix3Xd Jittered(const Eigen::Matrix3Xd& points, double size_m) {
  std::mt19937 random;  // with a lattice sequence, parallelograms would stay flat
  Eigen::Matrix3Xd out = points;
  for (double& x : out.reshaped()) x += size_m * 0x1p-32 * static_cast<double>(random());
  return out;
}

}  // namespace holdfast
