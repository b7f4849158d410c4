// SPDX-License-Identifier: MIT

// CGAL's property maps copy a default-constructed Eigen matrix; GCC 12 warns inside Eigen.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif

#include "geometry/mesh/collapse_edges.h"

#include <algorithm>
#include <vector>

#include <fmt/format.h>

#include "geometry/error.h"

namespace holdfast {
namespace {

[[noreturn]] void NotManifold(Eigen::Index face) {
  throw Error("mesh", fmt::format("face {} makes the surface non-manifold", face),
              "Make it manifold first, in MeshLab: Filters > Cleaning > Repair non Manifold Edges");
}

}  // namespace
}  // namespace holdfast

#ifndef HOLDFAST_WITHOUT_GPL

#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Bounded_normal_change_filter.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Edge_length_cost.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/GarlandHeckbert_plane_policies.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/GarlandHeckbert_probabilistic_plane_policies.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Midpoint_placement.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>
#include <CGAL/boost/graph/Euler_operations.h>

#include "geometry/mesh/triangle_tree.h"

namespace holdfast {
namespace {

namespace sms = CGAL::Surface_mesh_simplification;
using Kernel = CGAL::Simple_cartesian<double>;
using Point = Kernel::Point_3;
using SurfaceMesh = CGAL::Surface_mesh<Point>;

// Collapses that move a vertex farther than this fraction of the extent off the surface come last.
constexpr double kFarthestPerExtent = 0.01;
// Above this count a collapse moves a vertex by far less, so the check is skipped.
constexpr int kFilterBelow = 60'000;
// Down to this count, the shortest edges are collapsed to their midpoints, in a tenth of the time.
// The triangles are so much smaller than those of the result that the difference is not visible.
constexpr int kThinAbove = 200'000;
// Collapses beside a vertex cost the square of its degree: 2,000 triangles around one vertex take a
// minute. Above this degree the ring around the vertex is thinned first; its vertices are so dense
// that the difference is not visible.
constexpr unsigned kMaxAround = 256;

/// Rejects collapses that flip or flatten faces, or that move a vertex far off the original
/// surface: preserving the volume does not rule out spikes.
struct ShapeFilter {
  const TriangleTree* original;
  double farthest;

  /// OptionalPoint is Boost's optional in CGAL 5, the standard's in CGAL 6.
  template <typename Profile, typename OptionalPoint>
  OptionalPoint operator()(const Profile& profile, OptionalPoint placement) const {
    placement = sms::Bounded_normal_change_filter<>()(profile, placement);
    if (!placement) return placement;
    const Eigen::Vector3d p(placement->x(), placement->y(), placement->z());
    if (original->Closest(p).squared_distance > farthest * farthest) return OptionalPoint();
    return placement;
  }
};

/// Repeatedly collapses every other edge of the ring around each vertex of very high degree.
void ThinHubs(SurfaceMesh& mesh, int vertices) {
  std::vector<SurfaceMesh::Vertex_index> hubs;
  for (const auto v : mesh.vertices()) {
    if (mesh.degree(v) > kMaxAround) hubs.push_back(v);
  }
  const auto thin_once = [&](SurfaceMesh::Vertex_index hub) {
    std::vector<SurfaceMesh::Halfedge_index> ring;
    for (const auto spoke : mesh.halfedges_around_target(mesh.halfedge(hub))) {
      if (!mesh.is_border(spoke)) ring.push_back(mesh.prev(spoke));
    }
    for (std::size_t i = 0; i < ring.size(); i += 2) {
      const auto edge = mesh.edge(ring[i]);
      if (static_cast<int>(mesh.number_of_vertices()) <= vertices) return;
      if (mesh.is_removed(edge) || !CGAL::Euler::does_satisfy_link_condition(edge, mesh)) continue;
      CGAL::Euler::collapse_edge(edge, mesh);
    }
  };
  for (const auto hub : hubs) {
    for (unsigned before = 0; !mesh.is_removed(hub) && mesh.degree(hub) > kMaxAround;) {
      if (before == mesh.degree(hub)) break;  // none could be collapsed
      before = mesh.degree(hub);
      thin_once(hub);
    }
  }
  mesh.collect_garbage();
}

template <typename GetCost, typename GetPlacement>
void Collapse(SurfaceMesh& mesh, int vertices, const ShapeFilter* filter, const GetCost& cost,
              const GetPlacement& placement) {
  // Every collapse removes one vertex: counting vertices rather than edges hits the target exactly,
  // also with boundaries and handles.
  const auto stop = [&](const auto&, const auto&, std::size_t, std::size_t) {
    return static_cast<int>(mesh.number_of_vertices()) <= vertices;
  };
  const auto policies = CGAL::parameters::get_cost(cost).get_placement(placement);
  if (filter != nullptr) {
    sms::edge_collapse(mesh, stop, policies.filter(*filter));
  } else {
    sms::edge_collapse(mesh, stop, policies);
  }
  mesh.collect_garbage();
}

void CollapseBy(DecimateMethod method, SurfaceMesh& mesh, int vertices, const ShapeFilter* filter) {
  switch (method) {
    case DecimateMethod::kLindstromTurk:
      return Collapse(mesh, vertices, filter, sms::LindstromTurk_cost<SurfaceMesh>(),
                      sms::LindstromTurk_placement<SurfaceMesh>());
    case DecimateMethod::kGarlandHeckbert: {
      const sms::GarlandHeckbert_plane_policies<SurfaceMesh, Kernel> policies(mesh);
      return Collapse(mesh, vertices, filter, policies.get_cost(), policies.get_placement());
    }
    case DecimateMethod::kGarlandHeckbertProbabilistic: {
      const sms::GarlandHeckbert_probabilistic_plane_policies<SurfaceMesh, Kernel> policies(mesh);
      return Collapse(mesh, vertices, filter, policies.get_cost(), policies.get_placement());
    }
  }
}

SurfaceMesh ToCgal(const TriangleMesh& mesh, const Eigen::Vector3d& center, double scale) {
  SurfaceMesh out;
  out.reserve(static_cast<unsigned>(mesh.NumVertices()),
              static_cast<unsigned>(mesh.NumFaces() * 3 / 2),
              static_cast<unsigned>(mesh.NumFaces()));
  for (Eigen::Index v = 0; v < mesh.NumVertices(); ++v) {
    const Eigen::Vector3d p = (mesh.vertices.col(v) - center) / scale;
    out.add_vertex(Point(p.x(), p.y(), p.z()));
  }
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    const auto vertex = [&](int k) {
      return SurfaceMesh::Vertex_index(static_cast<unsigned>(mesh.faces(k, f)));
    };
    if (out.add_face(vertex(0), vertex(1), vertex(2)) == SurfaceMesh::null_face()) {
      NotManifold(f);
    }
  }
  return out;
}

TriangleMesh FromCgal(const SurfaceMesh& mesh, const Eigen::Vector3d& center, double scale) {
  TriangleMesh out;
  out.vertices.resize(3, mesh.number_of_vertices());
  out.faces.resize(3, mesh.number_of_faces());
  for (const auto v : mesh.vertices()) {
    const Point& p = mesh.point(v);
    out.vertices.col(v.idx()) = center + scale * Eigen::Vector3d(p.x(), p.y(), p.z());
  }
  for (const auto f : mesh.faces()) {
    int k = 0;
    for (const auto v : mesh.vertices_around_face(mesh.halfedge(f))) {
      out.faces(k++, f.idx()) = static_cast<int>(v.idx());
    }
  }
  return out;
}

}  // namespace

bool HasDecimateMethods() { return true; }

TriangleMesh CollapseEdges(const TriangleMesh& mesh, const DecimateOptions& options) {
  // In a box of unit size, so that no threshold depends on the unit or on a distant origin.
  const Eigen::Vector3d low = mesh.vertices.rowwise().minCoeff();
  const Eigen::Vector3d high = mesh.vertices.rowwise().maxCoeff();
  const Eigen::Vector3d center = 0.5 * (low + high);
  const double scale = (high - low).maxCoeff();
  SurfaceMesh surface = ToCgal(mesh, center, scale);
  const auto left = [&] { return static_cast<int>(surface.number_of_vertices()); };
  ThinHubs(surface, options.vertices);
  if (left() > std::max(kThinAbove, 10 * options.vertices)) {
    Collapse(surface, std::max(kThinAbove, 10 * options.vertices), nullptr,
             sms::Edge_length_cost<SurfaceMesh>(), sms::Midpoint_placement<SurfaceMesh>());
  }
  if (left() > std::max(kFilterBelow, options.vertices)) {
    CollapseBy(options.method, surface, std::max(kFilterBelow, options.vertices), nullptr);
  }
  // Within a pass, an edge that could not be collapsed is not retried although its neighborhood may
  // have changed. The filter is only dropped if the target cannot be reached with it.
  const TriangleMesh unit{(mesh.vertices.colwise() - center) / scale, mesh.faces};
  const TriangleTree original(unit);
  const ShapeFilter filter{&original, kFarthestPerExtent};
  for (const ShapeFilter* current : {&filter, static_cast<const ShapeFilter*>(nullptr)}) {
    for (int before = 0; before != left() && left() > options.vertices;) {
      before = left();
      CollapseBy(options.method, surface, options.vertices, current);
    }
  }
  return FromCgal(surface, center, scale);
}

}  // namespace holdfast

#else

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalFlippingT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>

namespace holdfast {

bool HasDecimateMethods() { return false; }

TriangleMesh CollapseEdges(const TriangleMesh& mesh, const DecimateOptions& options) {
  namespace om = OpenMesh;
  struct Traits : om::DefaultTraits {
    using Point = om::Vec3d;
    using Normal = om::Vec3d;
  };
  using Surface = om::TriMesh_ArrayKernelT<Traits>;
  Surface surface;
  std::vector<om::VertexHandle> ids;
  for (const auto p : mesh.vertices.colwise()) {
    ids.push_back(surface.add_vertex(om::Vec3d(p.x(), p.y(), p.z())));
  }
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    const Eigen::Vector3i face = mesh.faces.col(f);
    if (!surface.add_face(ids[face[0]], ids[face[1]], ids[face[2]]).is_valid()) {
      NotManifold(f);
    }
  }
  surface.request_face_normals();
  surface.update_face_normals();

  // The filter is only dropped if the target cannot be reached with it.
  for (const bool filtered : {true, false}) {
    om::Decimater::DecimaterT<Surface> decimater(surface);
    om::Decimater::ModQuadricT<Surface>::Handle quadric;
    om::Decimater::ModNormalFlippingT<Surface>::Handle flipping;
    decimater.add(quadric);
    if (filtered) decimater.add(flipping);
    decimater.module(quadric).unset_max_err();
    decimater.initialize();
    decimater.decimate_to(static_cast<std::size_t>(options.vertices));
    surface.garbage_collection();
  }

  TriangleMesh out;
  out.vertices.resize(3, static_cast<Eigen::Index>(surface.n_vertices()));
  out.faces.resize(3, static_cast<Eigen::Index>(surface.n_faces()));
  for (const auto v : surface.vertices()) {
    out.vertices.col(v.idx()) = Eigen::Vector3d(surface.point(v).data());
  }
  for (const auto f : surface.faces()) {
    int k = 0;
    for (const auto v : surface.fv_range(f)) out.faces(k++, f.idx()) = v.idx();
  }
  return out;
}

}  // namespace holdfast

#endif
