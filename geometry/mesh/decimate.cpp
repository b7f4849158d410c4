// SPDX-License-Identifier: MIT
#include "geometry/mesh/decimate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/mesh/collapse_edges.h"
#include "geometry/mesh/mesh_check.h"
#include "geometry/mesh/mesh_parts.h"
#include "geometry/mesh/mesh_topology.h"
#include "geometry/mesh/wrap.h"

namespace holdfast {
namespace {

constexpr int kFewestVertices = 4;
// Of a wrap, relative to the extent, the longest side of the bounding box.
constexpr double kWrapAlphaPerExtent = 50.0;
constexpr double kWrapOffsetPerExtent = 2000.0;

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
  result.method = HasDecimateMethods() ? options.method : DecimateMethod::kGarlandHeckbert;
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
    if (result.method != options.method) {
      result.notes.push_back(
          fmt::format("Decimated by OpenMesh, by quadrics: {} needs a build with HOLDFAST_GPL=ON.",
                      Name(options.method)));
    }
    result.mesh = CollapseEdges(surface, options);
    if (result.mesh.NumVertices() > options.vertices && may_wrap) {
      wrap(fmt::format("its handles and parts need {} vertices", result.mesh.NumVertices()));
      result.mesh = CollapseEdges(surface, options);
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
