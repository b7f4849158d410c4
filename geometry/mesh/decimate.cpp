// SPDX-License-Identifier: MIT

// CGAL's property maps copy a default-constructed Eigen matrix; GCC 12 warns inside Eigen.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif

#include "geometry/mesh/decimate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

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
#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/mesh/mesh_check.h"
#include "geometry/mesh/mesh_parts.h"
#include "geometry/mesh/mesh_topology.h"
#include "geometry/mesh/triangle_tree.h"
#include "geometry/mesh/wrap.h"

namespace holdfast {
namespace {

namespace sms = CGAL::Surface_mesh_simplification;
using Kernel = CGAL::Simple_cartesian<double>;
using Point = Kernel::Point_3;
using SurfaceMesh = CGAL::Surface_mesh<Point>;

constexpr int kFewestVertices = 4;
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
// Of a wrap, relative to the extent, the longest side of the bounding box.
constexpr double kWrapAlphaPerExtent = 50.0;
constexpr double kWrapOffsetPerExtent = 2000.0;

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

/// Minimum number of vertices that the parts of a surface need.
Eigen::Index FewestVertices(const MeshParts& found) {
  Eigen::Index count = 0;
  for (const MeshPart& part : found.parts) count += part.closed ? kFewestVertices : 3;
  return count;
}

/// FewestVertices after wrapping: parts whose boxes are farther apart than a wrap bridges stay
/// separate. (Its alpha is the radius of the ball that fits into gaps that are not bridged.)
Eigen::Index FewestVerticesWrapped(const MeshParts& found, double extent) {
  std::vector<MeshPart> parts = found.parts;
  constexpr std::size_t kMost = 20'000;  // beyond this, there are too many pairs to test
  if (parts.size() > kMost) return 0;
  std::ranges::sort(parts, {}, [](const MeshPart& part) { return part.min.x(); });
  const double bridged = 2.0 * extent / kWrapAlphaPerExtent + 2.0 * extent / kWrapOffsetPerExtent;
  DisjointSets sets(static_cast<int>(parts.size()));
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const Eigen::Array3d low = parts[i].min.array() - bridged,
                         high = parts[i].max.array() + bridged;
    for (std::size_t j = i + 1; j < parts.size() && parts[j].min.x() <= high.x(); ++j) {
      if ((parts[j].min.array() <= high).all() && (parts[j].max.array() >= low).all()) {
        sets.Merge(static_cast<int>(i), static_cast<int>(j));
      }
    }
  }
  Eigen::Index count = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const int part = static_cast<int>(i);
    if (sets.Find(part) == part) count += kFewestVertices;
  }
  return count;
}

/// Drops the smallest parts, less than a hundredth of the area in total, until the others need at
/// most a tenth of the vertices; the rest goes to the shape. Returns the number dropped.
Eigen::Index DropSmallParts(TriangleMesh& mesh, int vertices) {
  const MeshParts found = FindParts(mesh);
  const Eigen::Index enough = std::max(vertices / 10, 2 * kFewestVertices);
  Eigen::Index needed = FewestVertices(found);
  if (needed <= enough) return 0;
  std::vector<double> area(found.parts.size(), 0.0);
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    area[found.part_of_face[f]] += 0.5 * FaceCross(mesh, f).norm();
  }
  std::vector<std::size_t> smallest(area.size());
  std::iota(smallest.begin(), smallest.end(), 0);
  std::ranges::stable_sort(smallest, {}, [&](std::size_t part) { return area[part]; });
  double left = 0.01 * SurfaceArea(mesh);
  std::vector<bool> dropped(area.size(), false);
  Eigen::Index count = 0;
  for (const std::size_t part : smallest) {
    if (needed <= enough || area[part] > left) break;
    left -= area[part];
    needed -= found.parts[part].closed ? kFewestVertices : 3;
    dropped[part] = true;
    ++count;
  }
  if (count == 0) return 0;
  std::vector<Eigen::Index> kept;
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    if (!dropped[found.part_of_face[f]]) kept.push_back(f);
  }
  mesh.faces = mesh.faces(Eigen::all, kept).eval();
  DropUnreferenced(mesh);
  return count;
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
      throw Error(
          "mesh", fmt::format("face {} makes the surface non-manifold", f),
          "Make it manifold first, in MeshLab: Filters > Cleaning > Repair non Manifold Edges");
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

/// Collapses edges to the target count, or as far as topology allows. The mesh must be manifold.
TriangleMesh CollapseTo(const TriangleMesh& mesh, const DecimateOptions& options) {
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

}  // namespace

std::string_view Name(DecimateMethod method) {
  constexpr std::array<std::string_view, 3> kNames = {"lindstrom-turk", "garland-heckbert",
                                                      "garland-heckbert-probabilistic"};
  return kNames[static_cast<std::size_t>(method)];
}

DecimateMethod ParseDecimateMethod(std::string_view name) {
  std::string known;
  for (const DecimateMethod method : kDecimateMethods) {
    if (name == Name(method)) return method;
    known += known.empty() ? "" : ", ";
    known += Name(method);
  }
  throw Error("decimation method", fmt::format("'{}' is not known", name),
              fmt::format("Use one of {}", known));
}

DecimateResult Decimate(const TriangleMesh& mesh, const DecimateOptions& options) {
  if (options.vertices < kFewestVertices) {
    throw Error("vertices", fmt::format("{} are too few for a surface", options.vertices),
                "Ask for 4 or more");
  }
  DecimateResult result;
  RepairedMesh repaired = RepairMesh(mesh);
  TriangleMesh& surface = repaired.mesh;
  result.notes = std::move(repaired.actions);

  const EdgeCounts edges =
      CountEdges(surface.faces, EdgeTable(surface.faces, surface.NumVertices()));
  const bool may_wrap = options.allow_wrap && edges.boundary == 0;
  const auto wrap = [&](const std::string& reason) {
    const double extent = Extent(surface).maxCoeff();
    surface = WrapSurface(surface, extent / kWrapAlphaPerExtent, extent / kWrapOffsetPerExtent);
    result.notes.push_back(
        fmt::format("{}: the surface was wrapped first, which closes cavities, and tunnels "
                    "narrower than {:.2g} mm.",
                    reason, 1e3 * Extent(mesh).maxCoeff() / kWrapAlphaPerExtent));
  };
  const bool one_manifold = edges.non_manifold == 0 && edges.misoriented == 0;
  if (!one_manifold && edges.boundary > 0) {
    // Wrapping would close the surface, or double it.
    for (std::string& note : PartSheets(surface)) result.notes.push_back(std::move(note));
    if (const Eigen::Index dropped = DropSmallParts(surface, options.vertices); dropped > 0) {
      result.notes.push_back(
          fmt::format("Left out the {} smallest parts, less than 1 % of the area.", dropped));
    }
  } else if (!one_manifold) {
    const std::string problem =
        edges.non_manifold > 0
            ? fmt::format("{} edges have more than two faces", edges.non_manifold)
            : std::string("its surface has only one side (it is twisted like a Moebius strip)");
    if (!may_wrap) {
      throw Error(
          "mesh", problem,
          "Make it manifold first, in MeshLab: Filters > Cleaning > Repair non Manifold Edges");
    }
    wrap(problem);
  }
  const Eigen::Index parted = PartTouchingFans(surface);
  if (parted > 0) {
    result.notes.push_back(
        fmt::format("Split the surface at {} places where it touches in a point only.", parted));
  }

  if (surface.NumVertices() <= options.vertices) {
    result.notes.push_back(
        fmt::format("It has {} vertices, no more than the {} asked for: not decimated.",
                    surface.NumVertices(), options.vertices));
    result.mesh = std::move(surface);
  } else {
    const MeshParts found = FindParts(surface);
    const auto require = [&](Eigen::Index fewest) {
      if (fewest <= options.vertices) return;
      throw Error(
          "mesh",
          fmt::format("cannot be decimated to {} vertices: its {} loose parts need at least {}",
                      options.vertices, found.parts.size(), fewest),
          "Join its parts or leave some out in a mesh editor, or ask for more vertices "
          "(--object-vertices in a fit)");
    };
    if (const Eigen::Index fewest = FewestVertices(found); fewest > options.vertices) {
      require(may_wrap ? FewestVerticesWrapped(found, Extent(surface).maxCoeff()) : fewest);
      wrap(fmt::format("its {} parts need {} vertices", found.parts.size(), fewest));
      require(FewestVertices(FindParts(surface)));
    }
    result.mesh = CollapseTo(surface, options);
    if (result.mesh.NumVertices() > options.vertices && may_wrap) {
      wrap(fmt::format("its handles and parts need {} vertices", result.mesh.NumVertices()));
      result.mesh = CollapseTo(surface, options);
    }
    if (result.mesh.NumVertices() != options.vertices) {
      throw Error(
          "mesh",
          fmt::format("cannot be decimated to {} vertices: its parts, handles and holes need {}",
                      options.vertices, result.mesh.NumVertices()),
          fmt::format("Ask for {} or more", result.mesh.NumVertices()));
    }
  }
  if (options.samples > 0) {
    result.distance = MeasureSurfaceDistance(mesh, result.mesh, options.samples);
  }
  return result;
}

}  // namespace holdfast
