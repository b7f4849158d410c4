// SPDX-License-Identifier: MIT
#include "geometry/score/cut_surfaces.h"

#ifndef HOLDFAST_WITHOUT_GPL

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <variant>
#include <vector>

#include <Eigen/Geometry>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/corefinement.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/intersections.h>
#include <boost/variant/get.hpp>
#include <boost/variant/variant.hpp>

#include "geometry/mesh/mesh_parts.h"

namespace holdfast {
namespace {

namespace pmp = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using SurfaceMesh = CGAL::Surface_mesh<Kernel::Point_3>;
using FaceId = SurfaceMesh::Face_index;
using EdgeId = SurfaceMesh::Edge_index;

// A piece this close to the other surface, relative to the size, lies on it.
constexpr double kOnSurface = 1e-11;
// Faces of a piece tested for its side; the one farthest from the other surface decides.
constexpr std::size_t kWitnesses = 6;
// Tolerance for the sum of the vector areas of closed pieces, relative to their area.
constexpr double kClosed = 1e-7;

Eigen::Vector3d ToEigen(const Kernel::Point_3& p) { return {p.x(), p.y(), p.z()}; }

// Returns some faces as a separate mesh, with touching fans split.
TriangleMesh PartOf(const TriangleMesh& mesh, std::span<const int> faces) {
  TriangleMesh part;
  std::vector<int> new_id(static_cast<std::size_t>(mesh.NumVertices()), -1);
  std::vector<int> vertices;
  for (const int f : faces) {
    for (int k = 0; k < 3; ++k) {
      int& id = new_id[mesh.faces(k, f)];
      if (id >= 0) continue;
      id = static_cast<int>(vertices.size());
      vertices.push_back(mesh.faces(k, f));
    }
  }
  part.vertices.resize(3, static_cast<Eigen::Index>(vertices.size()));
  part.faces.resize(3, static_cast<Eigen::Index>(faces.size()));
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    part.vertices.col(i) = mesh.vertices.col(vertices[i]);
  }
  for (std::size_t i = 0; i < faces.size(); ++i) {
    for (int k = 0; k < 3; ++k) part.faces(k, i) = new_id[mesh.faces(k, faces[i])];
  }
  PartTouchingFans(part);
  return part;
}

SurfaceMesh ToSurfaceMesh(const TriangleMesh& mesh) {
  SurfaceMesh out;
  const auto count = [](Eigen::Index n) { return static_cast<SurfaceMesh::size_type>(n); };
  out.reserve(count(mesh.NumVertices()), count(3 * mesh.NumFaces() / 2 + 1),
              count(mesh.NumFaces()));
  for (const auto& p : mesh.vertices.colwise()) out.add_vertex({p.x(), p.y(), p.z()});
  using Vertex = SurfaceMesh::Vertex_index;
  for (const auto& f : mesh.faces.colwise()) {
    out.add_face(Vertex(f[0]), Vertex(f[1]), Vertex(f[2]));
  }
  return out;
}

// Contribution of the pieces of one surface to the integrals over the intersection's boundary.
struct Boundary {
  double volume_m3 = 0.0;
  double area_m2 = 0.0;
  Eigen::Vector3d area_vector = Eigen::Vector3d::Zero();
};

// Sums the pieces of a cut surface that lie inside the other body. Pieces on its surface count if
// `count_shared` is set and both have the same orientation.
template <typename CutMap>
void AddPiecesInside(const SurfaceMesh& mesh, const CutMap& is_cut, const SignedDistance& other,
                     const Eigen::Vector3d& origin, bool count_shared, Boundary& sum) {
  const double on_surface = kOnSurface * (other.Max() - other.Min()).norm();
  const auto corners = [&](FaceId face) {
    std::array<Eigen::Vector3d, 3> points;
    auto side = mesh.halfedge(face);
    for (Eigen::Vector3d& point : points) {
      point = ToEigen(mesh.point(mesh.target(side)));
      side = mesh.next(side);
    }
    return points;
  };
  const auto area_vector = [&](const std::array<Eigen::Vector3d, 3>& p) -> Eigen::Vector3d {
    return 0.5 * (p[1] - p[0]).cross(p[2] - p[0]);
  };
  std::vector<bool> seen(mesh.num_faces(), false);
  std::vector<FaceId> piece;
  std::vector<std::pair<double, FaceId>> largest;
  for (const FaceId start : mesh.faces()) {
    if (seen[start]) continue;
    seen[start] = true;
    piece.assign(1, start);
    for (std::size_t i = 0; i < piece.size(); ++i) {
      for (const auto side : mesh.halfedges_around_face(mesh.halfedge(piece[i]))) {
        const auto opposite = mesh.opposite(side);
        if (mesh.is_border(opposite) || get(is_cut, mesh.edge(side))) continue;
        const FaceId next = mesh.face(opposite);
        if (!seen[next]) {
          seen[next] = true;
          piece.push_back(next);
        }
      }
    }
    largest.clear();
    for (const FaceId face : piece) {
      largest.emplace_back(-area_vector(corners(face)).squaredNorm(), face);
    }
    const std::size_t witnesses = std::min(kWitnesses, largest.size());
    std::partial_sort(largest.begin(), largest.begin() + static_cast<std::ptrdiff_t>(witnesses),
                      largest.end());
    double distance = 0.0;
    bool same_way = false;
    for (std::size_t k = 0; k < witnesses; ++k) {
      const auto p = corners(largest[k].second);
      const SignedDistance::Result here = other.Query((p[0] + p[1] + p[2]) / 3.0);
      if (k > 0 && std::abs(here.distance) <= std::abs(distance)) continue;
      distance = here.distance;
      same_way = area_vector(p).dot(here.gradient) > 0.0;
    }
    const bool shared = std::abs(distance) <= on_surface;
    const bool counts = shared ? count_shared && same_way : distance < 0.0;
    if (!counts) continue;
    for (const FaceId face : piece) {
      const auto p = corners(face);
      const Eigen::Vector3d area = area_vector(p);
      sum.area_vector += area;
      sum.area_m2 += area.norm();
      sum.volume_m3 += (p[0] - origin).dot(area) / 3.0;
    }
  }
}

// Value of a variant if it has this type; boost::variant in CGAL 5, std::variant in CGAL 6.
template <typename Held, typename Variant>
const Held* IfHolds(const Variant& variant) {
  if constexpr (requires { std::get_if<Held>(&variant); }) {
    return std::get_if<Held>(&variant);
  } else {
    return boost::get<Held>(&variant);
  }
}

}  // namespace

bool CanCutSurfaces() { return true; }

ExactVolume CutVolume(const Solid& solid, const Solid& other, const SolidOverlap& overlap) {
  SurfaceMesh mesh_a = ToSurfaceMesh(PartOf(solid.mesh, overlap.faces_a));
  SurfaceMesh mesh_b = ToSurfaceMesh(PartOf(other.mesh, overlap.faces_b));
  auto cut_a = mesh_a.add_property_map<EdgeId, bool>("e:cut", false).first;
  auto cut_b = mesh_b.add_property_map<EdgeId, bool>("e:cut", false).first;
  try {
    // CGAL 5.5's own self-intersection check rejects valid meshes with a border, such as these.
    // Relevant self-intersections were tested above; closure of the pieces is checked below.
    pmp::corefine(mesh_a, mesh_b, CGAL::parameters::edge_is_constrained_map(cut_a),
                  CGAL::parameters::edge_is_constrained_map(cut_b));
  } catch (const pmp::Corefinement::Triple_intersection_exception&) {
    return {VolumeStatus::kSelfIntersecting, 0.0};
  } catch (const std::exception&) {
    return {VolumeStatus::kNotResolved, 0.0};
  }
  Boundary boundary;
  const Eigen::Vector3d origin = overlap.box.center();
  AddPiecesInside(mesh_a, cut_a, other.distance, origin, true, boundary);
  AddPiecesInside(mesh_b, cut_b, solid.distance, origin, false, boundary);
  if (boundary.area_vector.norm() > kClosed * boundary.area_m2) {
    return {VolumeStatus::kNotResolved, 0.0};
  }
  return {VolumeStatus::kExact, std::max(0.0, boundary.volume_m3)};
}

Eigen::Matrix3Xd SelfCrossings(const TriangleMesh& mesh, std::span<const int> faces) {
  const SurfaceMesh surface = ToSurfaceMesh(PartOf(mesh, faces));
  std::vector<std::pair<FaceId, FaceId>> pairs;
  pmp::self_intersections<CGAL::Sequential_tag>(surface, std::back_inserter(pairs));
  const auto triangle = [&](FaceId face) {
    const auto side = surface.halfedge(face);
    return Kernel::Triangle_3(surface.point(surface.source(side)),
                              surface.point(surface.target(side)),
                              surface.point(surface.target(surface.next(side))));
  };
  const auto has_corner = [](const Kernel::Triangle_3& face, const Kernel::Point_3& point) {
    return face[0] == point || face[1] == point || face[2] == point;
  };
  Eigen::Matrix3Xd places(3, static_cast<Eigen::Index>(pairs.size()));
  Eigen::Index count = 0;
  for (const auto& [first, second] : pairs) {
    const Kernel::Triangle_3 a = triangle(first);
    const Kernel::Triangle_3 b = triangle(second);
    // Faces with a common corner always meet there, so the midpoint of the segment is used.
    Eigen::Vector3d place = (ToEigen(CGAL::centroid(a)) + ToEigen(CGAL::centroid(b))) / 2.0;
    if (const auto common = CGAL::intersection(a, b)) {
      if (const auto* segment = IfHolds<Kernel::Segment_3>(*common)) {
        place = (ToEigen(segment->source()) + ToEigen(segment->target())) / 2.0;
      } else if (const auto* point = IfHolds<Kernel::Point_3>(*common)) {
        // Split fans touch only in a corner; this is not a crossing.
        if (has_corner(a, *point) && has_corner(b, *point)) continue;
        place = ToEigen(*point);
      }
    }
    places.col(count++) = place;
  }
  return places.leftCols(count);
}

}  // namespace holdfast

#else

namespace holdfast {

bool CanCutSurfaces() { return false; }

ExactVolume CutVolume(const Solid&, const Solid&, const SolidOverlap&) {
  return {VolumeStatus::kNotBuilt, 0.0};
}

Eigen::Matrix3Xd SelfCrossings(const TriangleMesh&, std::span<const int>) { return {}; }

}  // namespace holdfast

#endif
