// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <map>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "geometry/error.h"
#include "geometry/mesh/mesh_check.h"
#include "geometry/mesh/mesh_parts.h"
#include "geometry/mesh/mesh_topology.h"

namespace holdfast {
namespace {

/// Keeps the faces for which keep(f); returns how many went.
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

/// A face without area whose corners differ: corner b lies on the side from a to c. Each face acd
/// (or cad) on the other side of ac is divided at b, which closes the gap the flat face leaves: the
/// surface stays as it is. A side of several such corners takes several rounds.
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
    std::map<std::pair<int, int>, std::vector<int>> sides;  // of flat faces' longest sides
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
        if (apex == middle) {  // two flat faces back to back: both go
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

/// Distances and collapses beside a vertex take the square of its faces' number.
void RequireNoHub(const TriangleMesh& mesh) {
  constexpr int kMostFaces = 20'000;
  std::vector<int> around(mesh.NumVertices(), 0);
  for (const int v : mesh.faces.reshaped()) {
    if (++around[v] <= kMostFaces) continue;
    throw Error("mesh", fmt::format("has more than {} faces around one vertex", kMostFaces),
                "Split its largest polygon evenly, or remesh it (Blender: Remesh)");
  }
}

/// Turns closed parts that point inwards, with everything inside them so that cavities stay
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
  RepairedMesh result{mesh, {}, {}};
  TriangleMesh& out = result.mesh;
  const auto note = [&](Eigen::Index n, const char* done, const char* one, const char* many) {
    if (n > 0) result.actions.push_back(fmt::format("{} {} {}.", done, n, n == 1 ? one : many));
  };

  const std::vector<int> first = FirstAtSamePlace(out.vertices);
  Eigen::Index welded = 0;
  for (std::size_t v = 0; v < first.size(); ++v) welded += first[v] != static_cast<int>(v);
  for (int& v : out.faces.reshaped()) v = first[v];
  RequireNoHub(out);
  note(welded, "Welded", "vertex at the place of another", "vertices at the places of others");

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
  note(OrientConsistently(out), "Turned", "face to agree with its neighbours",
       "faces to agree with their neighbours");
  note(TurnOutwards(out), "Turned", "closed part outwards", "closed parts outwards");
  result.source_vertex = DropUnreferenced(out);
  note(mesh.NumVertices() - welded - out.NumVertices(), "Dropped", "vertex of no face",
       "vertices of no face");
  return result;
}

}  // namespace holdfast
