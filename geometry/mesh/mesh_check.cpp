// SPDX-License-Identifier: MIT
#include "geometry/mesh/mesh_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "geometry/error.h"
#include "geometry/mesh/mesh_parts.h"
#include "geometry/mesh/mesh_topology.h"

namespace holdfast {
namespace {

constexpr double kLargestPlausible_m = 2.0;
constexpr double kSmallestPlausible_m = 0.005;
constexpr double kTypicalSize_m = 0.07;         // geometric mean of the extents of handheld objects
constexpr double kDecade = 3.1622776601683795;  // square root of 10: half way to the next unit

// Number of vertices at the position of an earlier one, from FirstAtSamePlace.
Eigen::Index CountDuplicates(const std::vector<int>& first) {
  Eigen::Index count = 0;
  for (std::size_t v = 0; v < first.size(); ++v) count += first[v] != static_cast<int>(v);
  return count;
}

// Returns for each face whether an earlier face has the same three corners in any order.
std::vector<bool> DuplicateFaces(const Eigen::Matrix3Xi& faces) {
  std::vector<std::pair<std::array<int, 3>, int>> keys(faces.cols());  // sorted corners, face
  for (int f = 0; f < faces.cols(); ++f) {
    keys[f] = {{faces(0, f), faces(1, f), faces(2, f)}, f};
    std::ranges::sort(keys[f].first);
  }
  std::ranges::sort(keys);
  std::vector<bool> duplicate(faces.cols(), false);
  for (std::size_t i = 1; i < keys.size(); ++i) {
    if (keys[i].first == keys[i - 1].first) duplicate[keys[i].second] = true;
  }
  return duplicate;
}

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

// Size of an object in the hand: the geometric mean of its extents, so that a sword does not count
// as smaller than a ball. Extents are clamped, so that a flat sheet is not of size zero.
double HandSize(const Eigen::Vector3d& extent) {
  const double longest = extent.maxCoeff();
  return std::cbrt(extent.cwiseMax(0.02 * longest).prod());
}

bool IsPlausible(double longest) {
  return longest <= kLargestPlausible_m && longest >= kSmallestPlausible_m;
}

// Metric units differ by a factor of ten or more: at most one is typical. Inches come last.
constexpr double kScales[] = {0.001, 0.01, 1000.0, 0.0254};

std::string_view UnitOfScale(double scale) {
  if (scale == 0.001) return "millimeters";
  if (scale == 0.01) return "centimeters";
  return scale == 0.0254 ? "inches" : "kilometers";
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
  report.num_duplicate_vertices = CountDuplicates(FirstAtSamePlace(mesh.vertices));
  report.num_duplicate_faces = std::ranges::count(DuplicateFaces(mesh.faces), true);
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
      // Orientations must alternate from outside to inside.
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
  if (scales.empty()) return "Meshes are in meters: give its unit with --object-scale";
  const bool is_stl = path.ends_with(".stl") || path.ends_with(".STL");
  std::string text = "Meshes are in meters, this one is likely in ";
  for (std::size_t i = 0; i < scales.size(); ++i) {
    const Eigen::Vector3d in_cm = 100.0 * scales[i] * extent_m;
    text += fmt::format("{}{}{}: --object-scale {:g} makes it {:.3g} x {:.3g} x {:.3g} cm",
                        i > 0 ? "; or in " : "", UnitOfScale(scales[i]),
                        is_stl && scales[i] == 0.001 ? ", as usual for .stl files" : "", scales[i],
                        in_cm.x(), in_cm.y(), in_cm.z());
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
        "where parts of the surface touch only at a point");
  fault(report.num_duplicate_vertices, "vertex", "vertices",
        "at exactly the position of another (repair welds them)");
  fault(report.num_unreferenced_vertices, "vertex", "vertices", "of no face (repair drops them)");
  fault(report.num_degenerate_faces, "face", "faces", "without area (repair removes them)");
  fault(report.num_duplicate_faces, "face", "faces", "given more than once (repair drops them)");
  fault(report.num_misoriented_edges, "edge", "edges",
        "between faces of opposite orientation (repair flips them where it can)");
  fault(report.num_inside_out_components, "closed component", "closed components",
        "inside out (repair flips them)");
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

namespace {

/// Keeps the faces for which keep(f) is true. Returns the number of dropped faces.
template <typename Keep>
Eigen::Index FilterFaces(Eigen::Matrix3Xi& faces, Keep&& keep) {
  Eigen::Index n = 0;
  for (Eigen::Index f = 0; f < faces.cols(); ++f) {
    if (keep(f)) faces.col(n++) = faces.col(f);
  }
  const Eigen::Index dropped = faces.cols() - n;
  faces.conservativeResize(Eigen::NoChange, n);
  return dropped;
}

/// Removes faces without area whose corners differ: corner b lies on the side from a to c. Each
/// face acd (or cad) on the other side of ac is split at b, which closes the gap left by the flat
/// face; the surface is unchanged. A side with several such corners takes several rounds.
Eigen::Index RemoveFlatFaces(TriangleMesh& mesh) {
  Eigen::Index removed = 0;
  constexpr int kMaxRounds = 64;
  for (int round = 0; round < kMaxRounds; ++round) {
    std::vector<int> flat;
    for (int f = 0; f < mesh.NumFaces(); ++f) {
      if (HasNoArea(mesh, f)) flat.push_back(f);
    }
    if (flat.empty()) break;

    const EdgeTable edges(mesh.faces, mesh.NumVertices());
    std::map<std::pair<int, int>, std::vector<int>> sides;  // longest sides of flat faces
    const auto longest_side = [&](int f) {
      int longest = 0;
      double length = -1.0;
      for (int k = 0; k < 3; ++k) {
        const double side =
            (mesh.vertices.col(mesh.faces(k, f)) - mesh.vertices.col(mesh.faces((k + 1) % 3, f)))
                .squaredNorm();
        if (side > length) {
          length = side;
          longest = k;
        }
      }
      return longest;
    };
    const auto side_key = [&](int f, int k) {
      const int a = mesh.faces(k, f);
      const int b = mesh.faces((k + 1) % 3, f);
      return std::pair<int, int>(std::min(a, b), std::max(a, b));
    };
    for (const int f : flat) sides[side_key(f, longest_side(f))];
    edges.ForEach([&](int low, int high, std::span<const int> corners) {
      const auto found = sides.find({low, high});
      if (found != sides.end()) found->second.assign(corners.begin(), corners.end());
    });

    std::vector<bool> touched(mesh.NumFaces(), false);
    std::vector<bool> dropped(mesh.NumFaces(), false);
    std::vector<Eigen::Vector3i> added;
    bool progress = false;
    for (const int f : flat) {
      if (touched[f]) continue;
      const int k = longest_side(f);
      const int middle = mesh.faces((k + 2) % 3, f);
      const std::vector<int>& around = sides[side_key(f, k)];
      if (std::any_of(around.begin(), around.end(), [&](int c) { return touched[c / 3]; }))
        continue;
      for (const int corner : around) {
        const int g = corner / 3;
        touched[g] = true;
        if (g == f) continue;
        const int from = mesh.faces(corner % 3, g);
        const int to = mesh.faces((corner % 3 + 1) % 3, g);
        const int apex = mesh.faces((corner % 3 + 2) % 3, g);
        if (apex == middle) {  // two flat faces back to back: both are removed
          dropped[g] = true;
          ++removed;
          continue;
        }
        mesh.faces.col(g) << from, middle, apex;
        added.emplace_back(middle, to, apex);
      }
      dropped[f] = true;
      ++removed;
      progress = true;
    }
    const Eigen::Index kept = mesh.NumFaces();
    mesh.faces.conservativeResize(Eigen::NoChange, kept + static_cast<Eigen::Index>(added.size()));
    for (std::size_t i = 0; i < added.size(); ++i) mesh.faces.col(kept + i) = added[i];
    dropped.resize(mesh.NumFaces(), false);
    FilterFaces(mesh.faces, [&](Eigen::Index f) { return !dropped[f]; });
    if (!progress) break;
  }
  return removed;
}

/// Distances and collapses beside a vertex cost the square of its degree.
void RequireNoHub(const TriangleMesh& mesh) {
  constexpr int kMaxFaces = 20'000;
  std::vector<int> around(mesh.NumVertices(), 0);
  for (const int v : mesh.faces.reshaped()) {
    if (++around[v] <= kMaxFaces) continue;
    throw Error("mesh", fmt::format("has more than {} faces around one vertex", kMaxFaces),
                "Split its largest polygon evenly, or remesh it (Blender: Remesh)");
  }
}

/// Flips closed parts that point inwards, with everything inside them so that cavities stay
/// cavities.
Eigen::Index TurnOutwards(TriangleMesh& mesh) {
  const MeshParts parts = FindParts(mesh);
  std::vector<bool> inside_out(parts.parts.size(), false);
  Eigen::Index count = 0;
  for (std::size_t p = 0; p < parts.parts.size(); ++p) {
    const MeshPart& part = parts.parts[p];
    if (part.closed && part.consistent && part.enclosed_by.empty() && part.volume_m3 < 0.0) {
      inside_out[p] = true;
      ++count;
    }
  }
  if (count == 0) return 0;
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    const int part = parts.part_of_face[f];
    if (part < 0) continue;
    const std::vector<int>& around = parts.parts[part].enclosed_by;
    const bool with_its_outermost =
        std::any_of(around.begin(), around.end(), [&](int outer) { return inside_out[outer]; });
    if (inside_out[part] || with_its_outermost) FlipFace(mesh.faces, f);
  }
  return count;
}

}  // namespace

RepairedMesh RepairMesh(const TriangleMesh& mesh) {
  RequireValid(mesh);
  RepairedMesh result{mesh, {}};
  TriangleMesh& out = result.mesh;
  const auto note = [&](Eigen::Index n, const char* done, const char* one, const char* many) {
    if (n > 0) result.actions.push_back(fmt::format("{} {} {}.", done, n, n == 1 ? one : many));
  };

  const std::vector<int> first = FirstAtSamePlace(out.vertices);
  const Eigen::Index welded = CountDuplicates(first);
  for (int& v : out.faces.reshaped()) v = first[v];
  RequireNoHub(out);
  note(welded, "Welded", "vertex at the position of another",
       "vertices at the positions of others");

  note(FilterFaces(out.faces, [&](Eigen::Index f) { return !HasRepeatedCorner(out.faces.col(f)); }),
       "Dropped", "face with a repeated corner", "faces with a repeated corner");
  const std::vector<bool> duplicate = DuplicateFaces(out.faces);
  note(FilterFaces(out.faces, [&](Eigen::Index f) { return !duplicate[f]; }), "Dropped",
       "face given more than once", "faces given more than once");
  note(RemoveFlatFaces(out), "Removed", "face without area", "faces without area");
  if (out.NumFaces() == 0) {
    throw Error("mesh", "no face with an area is left after repair",
                "Give a surface, not points or lines.");
  }
  note(OrientConsistently(out), "Turned", "face to agree with its neighbors",
       "faces to agree with their neighbors");
  note(TurnOutwards(out), "Turned", "closed part outwards", "closed parts outwards");
  DropUnreferenced(out);
  note(mesh.NumVertices() - welded - out.NumVertices(), "Dropped", "vertex of no face",
       "vertices of no face");
  return result;
}

}  // namespace holdfast
