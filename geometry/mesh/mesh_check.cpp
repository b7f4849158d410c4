// SPDX-License-Identifier: MIT
#include "geometry/mesh/mesh_check.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/mesh/mesh_parts.h"
#include "geometry/mesh/mesh_topology.h"

namespace holdfast {
namespace {

constexpr double kLargestPlausible_m = 2.0;
constexpr double kSmallestPlausible_m = 0.005;
constexpr double kTypicalSize_m = 0.07;         // geometric mean of the extents of what hands hold
constexpr double kDecade = 3.1622776601683795;  // root of 10: as far as half way to the next unit

void CountTopology(const TriangleMesh& mesh, MeshReport& report) {
  const EdgeTable edges(mesh.faces, mesh.NumVertices());
  const EdgeCounts counts = CountEdges(mesh.faces, edges);
  report.num_edges = counts.all;
  report.num_boundary_edges = counts.boundary;
  report.num_non_manifold_edges = counts.non_manifold;
  report.num_misoriented_edges = counts.misoriented;

  DisjointSets fans = FindFans(mesh.faces, edges);
  std::vector<std::uint8_t> num_fans(mesh.NumVertices(), 0);
  std::vector<std::uint8_t> referenced(mesh.NumVertices(), 0);
  for (int f = 0; f < mesh.NumFaces(); ++f) {
    const bool repeated = HasRepeatedCorner(mesh.faces.col(f));
    for (int k = 0; k < 3; ++k) {
      const int vertex = mesh.faces(k, f);
      referenced[vertex] = 1;
      if (repeated || fans.Find(3 * f + k) != 3 * f + k) continue;
      if (num_fans[vertex] < 2 && ++num_fans[vertex] == 2) ++report.num_non_manifold_vertices;
    }
  }
  report.num_unreferenced_vertices = std::count(referenced.begin(), referenced.end(), 0);

  Eigen::Vector3d low = Eigen::Vector3d::Zero();
  Eigen::Vector3d high = low;
  bool first = true;
  for (Eigen::Index v = 0; v < mesh.NumVertices(); ++v) {
    if (!referenced[v]) continue;
    low = first ? Eigen::Vector3d(mesh.vertices.col(v)) : low.cwiseMin(mesh.vertices.col(v));
    high = first ? Eigen::Vector3d(mesh.vertices.col(v)) : high.cwiseMax(mesh.vertices.col(v));
    first = false;
  }
  report.extent_m = high - low;
}

// How large something is in the hand: the geometric mean of its extents, so that a sword is not
// taken for smaller than a ball, nor a sheet of no thickness for nothing.
double HandSize(const Eigen::Vector3d& extent) {
  const double longest = extent.maxCoeff();
  return std::cbrt(extent.cwiseMax(0.02 * longest).prod());
}

bool IsPlausible(double longest) {
  return longest <= kLargestPlausible_m && longest >= kSmallestPlausible_m;
}

// Metric units are a factor of ten or more apart: at most one of them is typical. Inches come last.
constexpr double kScales[] = {0.001, 0.01, 1000.0, 0.0254};

std::string_view UnitOfScale(double scale) {
  if (scale == 0.001) return "millimetres";
  if (scale == 0.01) return "centimetres";
  return scale == 0.0254 ? "inches" : "kilometres";
}

bool IsTypical(const Eigen::Vector3d& extent_m, double scale) {
  const double factor = HandSize(extent_m) * scale / kTypicalSize_m;
  return IsPlausible(extent_m.maxCoeff() * scale) && factor > 1.0 / kDecade && factor <= kDecade;
}

void JudgeSize(MeshReport& report) {
  report.implausible_size = !IsPlausible(report.extent_m.maxCoeff());
  if (!report.implausible_size) return;
  for (const double scale : kScales) {
    if (!IsTypical(report.extent_m, scale)) continue;
    report.suggested_scale = scale;
    return;
  }
}

}  // namespace

MeshReport CheckMesh(const TriangleMesh& mesh) {
  RequireValid(mesh);
  MeshReport report;
  report.num_vertices = mesh.NumVertices();
  report.num_faces = mesh.NumFaces();
  report.num_duplicate_vertices = CountDuplicateVertices(mesh.vertices);
  report.num_duplicate_faces = CountDuplicateFaces(mesh.faces);
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    if (HasRepeatedCorner(mesh.faces.col(f)) || HasNoArea(mesh, f)) ++report.num_degenerate_faces;
  }
  report.area_m2 = SurfaceArea(mesh);
  report.volume_m3 = SignedVolume(mesh);
  CountTopology(mesh, report);

  const MeshParts parts = FindParts(mesh);
  report.num_components = static_cast<Eigen::Index>(parts.parts.size());
  for (const MeshPart& part : parts.parts) {
    if (!part.closed || !part.consistent) continue;
    const bool outwards = part.volume_m3 > 0.0;
    if (part.enclosed_by.empty()) {
      if (!outwards) ++report.num_inside_out_components;
    } else {
      // Surfaces must alternate from outside in.
      const bool should_point_outwards = part.enclosed_by.size() % 2 == 0;
      if (outwards != should_point_outwards) ++report.num_nested_solids;
    }
  }
  report.watertight = report.num_faces > 0 && report.num_boundary_edges == 0 &&
                      report.num_non_manifold_edges == 0 && report.num_non_manifold_vertices == 0 &&
                      report.num_degenerate_faces == 0 && report.num_duplicate_faces == 0 &&
                      report.num_misoriented_edges == 0 && report.num_inside_out_components == 0 &&
                      report.num_nested_solids == 0;
  JudgeSize(report);
  return report;
}

std::vector<double> PossibleScales(const Eigen::Vector3d& extent_m, std::string_view path) {
  constexpr double kLeast_m = 0.01, kMost_m = 0.3;
  std::vector<double> scales;
  if (IsPlausible(extent_m.maxCoeff())) return scales;
  for (const double scale : kScales) {
    const double size = HandSize(extent_m) * scale;
    if (IsPlausible(extent_m.maxCoeff() * scale) && size >= kLeast_m && size <= kMost_m) {
      scales.push_back(scale);
    }
  }
  const bool is_stl = path.ends_with(".stl") || path.ends_with(".STL");
  const auto is_likely = [&](double scale) {
    return is_stl ? scale == 0.001 : IsTypical(extent_m, scale);
  };
  std::ranges::stable_partition(scales, is_likely);
  return scales;
}

std::string UnitRemedy(const Eigen::Vector3d& extent_m, std::string_view path) {
  const std::vector<double> scales = PossibleScales(extent_m, path);
  if (scales.empty()) return "Meshes are in metres: give its unit with --object-scale";
  const bool is_stl = path.ends_with(".stl") || path.ends_with(".STL");
  std::string text = "Meshes are in metres, this one is likely in ";
  for (std::size_t i = 0; i < scales.size(); ++i) {
    const Eigen::Vector3d in_cm = 100.0 * scales[i] * extent_m;
    text += fmt::format("{}{}{}: --object-scale {:g} makes it {:.3g} x {:.3g} x {:.3g} cm",
                        i > 0 ? "; or in " : "", UnitOfScale(scales[i]),
                        is_stl && scales[i] == 0.001 ? ", as .stl files are by custom" : "",
                        scales[i], in_cm.x(), in_cm.y(), in_cm.z());
  }
  return text;
}

std::vector<std::string> Describe(const MeshReport& report) {
  std::vector<std::string> lines;
  const auto plural = [](Eigen::Index n, const char* one, const char* many) {
    return fmt::format("{} {}", n, n == 1 ? one : many);
  };
  lines.push_back(fmt::format("{}, {}, {}, {}.", plural(report.num_vertices, "vertex", "vertices"),
                              plural(report.num_faces, "face", "faces"),
                              plural(report.num_edges, "edge", "edges"),
                              plural(report.num_components, "component", "components")));
  const Eigen::Vector3d& e = report.extent_m;
  const double size = e.maxCoeff();
  const bool closed = report.num_boundary_edges == 0 && report.num_non_manifold_edges == 0;
  const std::string volume =
      closed ? fmt::format(", volume {:.4g} cm^3", report.volume_m3 * 1e6) : std::string();
  lines.push_back(fmt::format("Extent {:.4g} x {:.4g} x {:.4g} m, area {:.4g} cm^2{}.", e.x(),
                              e.y(), e.z(), report.area_m2 * 1e4, volume));
  if (report.watertight) {
    lines.push_back("Watertight: closed, manifold, consistently oriented, faces outwards.");
  } else {
    lines.push_back("Not watertight: inside and outside are not certain everywhere.");
  }
  const auto fault = [&](Eigen::Index n, const char* one, const char* many, const char* what) {
    if (n > 0) lines.push_back(fmt::format("{} {}.", plural(n, one, many), what));
  };
  fault(report.num_boundary_edges, "boundary edge", "boundary edges",
        "around holes: the surface is open there");
  fault(report.num_non_manifold_edges, "edge", "edges", "shared by three faces or more");
  fault(report.num_non_manifold_vertices, "vertex", "vertices",
        "where parts of the surface touch in a point only");
  fault(report.num_duplicate_vertices, "vertex", "vertices",
        "at exactly the place of another (repair welds them)");
  fault(report.num_unreferenced_vertices, "vertex", "vertices", "of no face (repair drops them)");
  fault(report.num_degenerate_faces, "face", "faces", "without area (repair removes them)");
  fault(report.num_duplicate_faces, "face", "faces", "given more than once (repair drops them)");
  fault(report.num_misoriented_edges, "edge", "edges",
        "between faces of opposite orientation (repair turns them where it can)");
  fault(report.num_inside_out_components, "closed component", "closed components",
        "inside out (repair turns them)");
  fault(report.num_nested_solids, "closed component", "closed components",
        "inside another solid without being a cavity");
  if (report.implausible_size) {
    std::string line = fmt::format("The largest extent of {:.4g} m is {} for a handheld object",
                                   size, size > kLargestPlausible_m ? "large" : "small");
    std::string_view join = ": the file may be in";
    for (const double scale : PossibleScales(report.extent_m, "")) {
      line += fmt::format("{} {} (scale it by {:g})", std::exchange(join, " or"),
                          UnitOfScale(scale), scale);
    }
    lines.push_back(line + ".");
  }
  return lines;
}

}  // namespace holdfast
