// SPDX-License-Identifier: MIT
#include "geometry/mesh/mesh_parts.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <numeric>
#include <span>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "geometry/error.h"
#include "geometry/mesh/mesh_topology.h"
#include "geometry/mesh/winding_number.h"

namespace holdfast {
namespace {

constexpr double kFlat = 1e-10;

bool BoxContains(const MeshPart& outer, const MeshPart& inner) {
  return (outer.min.array() <= inner.min.array()).all() &&
         (outer.max.array() >= inner.max.array()).all();
}

/// Fills `enclosed_by`. Only tests pairs of nested boxes; a part is represented by its first
/// vertex.
void FindNesting(const TriangleMesh& mesh, MeshParts& parts) {
  std::vector<int> solids;
  for (std::size_t p = 0; p < parts.parts.size(); ++p) {
    if (parts.parts[p].closed && parts.parts[p].consistent) solids.push_back(static_cast<int>(p));
  }
  if (solids.size() < 2) return;
  // Largest boxes first: a part can only lie in an earlier one.
  const auto box_volume = [&](int p) { return (parts.parts[p].max - parts.parts[p].min).prod(); };
  std::stable_sort(solids.begin(), solids.end(),
                   [&](int a, int b) { return box_volume(a) > box_volume(b); });
  std::vector<std::vector<int>> faces(parts.parts.size());  // of each part, ascending
  for (std::size_t f = 0; f < parts.part_of_face.size(); ++f) {
    const int part = parts.part_of_face[f];
    if (part >= 0) faces[part].push_back(static_cast<int>(f));
  }
  std::vector<std::unique_ptr<WindingNumber>> winding(parts.parts.size());
  const auto winding_of = [&](int part) -> const WindingNumber& {
    if (!winding[part]) {
      TriangleMesh piece;
      piece.vertices.resize(3, 3 * std::ssize(faces[part]));
      piece.faces.resize(3, std::ssize(faces[part]));
      for (int i = 0; i < piece.NumFaces(); ++i) {
        for (int k = 0; k < 3; ++k) {
          piece.vertices.col(3 * i + k) = mesh.vertices.col(mesh.faces(k, faces[part][i]));
          piece.faces(k, i) = 3 * i + k;
        }
      }
      winding[part] = std::make_unique<WindingNumber>(piece);
    }
    return *winding[part];
  };
  for (std::size_t i = 1; i < solids.size(); ++i) {
    MeshPart& inner = parts.parts[solids[i]];
    const Eigen::Vector3d point = mesh.vertices.col(mesh.faces(0, inner.first_face));
    for (std::size_t j = 0; j < i; ++j) {
      if (!BoxContains(parts.parts[solids[j]], inner)) continue;
      if (std::abs(winding_of(solids[j]).At(point)) > 0.5) inner.enclosed_by.push_back(solids[j]);
    }
  }
}

constexpr int kNone = -1;
// At edges of more faces, none are paired: there are too many pairs, and sheets are ambiguous.
constexpr std::size_t kMaxSheets = 64;

// Pairs the sides of one edge; `partner` is kNone for each of them on entry.
void PairSides(const TriangleMesh& mesh, std::span<const int> sides, DisjointSets& patches,
               std::vector<int>& partner) {
  if (sides.size() > kMaxSheets) return;
  const auto corner = [&](int side, int k) { return mesh.faces((side % 3 + k) % 3, side / 3); };
  const Eigen::Vector3d start = mesh.vertices.col(corner(sides[0], 0));
  const Eigen::Vector3d along = (mesh.vertices.col(corner(sides[0], 1)) - start).stableNormalized();
  std::vector<Eigen::Vector3d> away;  // direction away from the edge within each face
  for (const int side : sides) {
    const Eigen::Vector3d apex = mesh.vertices.col(corner(side, 2)) - start;
    away.push_back((apex - apex.dot(along) * along).stableNormalized());
  }
  // Other patches, disagreeing orientations, the bend, and the two sides. The bend is rounded, so
  // that ties of symmetric sheets are the same on any processor.
  std::vector<std::tuple<bool, bool, std::int64_t, std::size_t, std::size_t>> pairs;
  for (std::size_t a = 0; a < sides.size(); ++a) {
    for (std::size_t b = a + 1; b < sides.size(); ++b) {
      const bool same_patch = patches.Find(sides[a] / 3) == patches.Find(sides[b] / 3);
      const bool disagree = corner(sides[a], 0) == corner(sides[b], 0);
      if (same_patch && disagree) continue;  // would be one-sided
      pairs.emplace_back(!same_patch, disagree, std::llround(1e6 * away[a].dot(away[b])), a, b);
    }
  }
  std::ranges::sort(pairs);
  for (const auto& [other_patch, disagree, bend, a, b] : pairs) {
    if (partner[sides[a]] != kNone || partner[sides[b]] != kNone) continue;
    partner[sides[a]] = sides[b];
    partner[sides[b]] = sides[a];
  }
}

// Gives each fan of corners at a vertex a vertex of its own. Returns the number of added vertices.
Eigen::Index PartFans(DisjointSets& fans, TriangleMesh& mesh) {
  std::vector<int> vertex_of_fan(3 * mesh.NumFaces(), -1);
  std::vector<bool> taken(mesh.NumVertices(), false);
  std::vector<int> added;  // the vertex that each copy duplicates
  for (int corner = 0; corner < 3 * mesh.NumFaces(); ++corner) {
    int& vertex = mesh.faces(corner % 3, corner / 3);
    int& own = vertex_of_fan[fans.Find(corner)];
    if (own < 0) {
      own = vertex;
      if (taken[vertex]) {
        own = static_cast<int>(mesh.NumVertices() + added.size());
        added.push_back(vertex);
      }
      taken[vertex] = true;
    }
    vertex = own;
  }
  const Eigen::Index before = mesh.NumVertices();
  mesh.vertices.conservativeResize(Eigen::NoChange,
                                   before + static_cast<Eigen::Index>(added.size()));
  for (std::size_t i = 0; i < added.size(); ++i) {
    mesh.vertices.col(before + i) = mesh.vertices.col(added[i]);
  }
  return static_cast<Eigen::Index>(added.size());
}

}  // namespace

void RequireValid(const TriangleMesh& mesh) {
  const char* remedy = "Check the program that wrote it.";
  if (mesh.NumFaces() > std::numeric_limits<int>::max() / 3 ||
      mesh.NumVertices() > std::numeric_limits<int>::max()) {
    throw Error("mesh", "has more than 715 million faces or 2^31 vertices", "Decimate it first.");
  }
  for (Eigen::Index v = 0; v < mesh.NumVertices(); ++v) {
    if (!mesh.vertices.col(v).allFinite()) {
      throw Error("mesh", fmt::format("vertex {} has a coordinate that is not finite", v), remedy);
    }
  }
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    if (mesh.faces.col(f).minCoeff() < 0 || mesh.faces.col(f).maxCoeff() >= mesh.NumVertices()) {
      throw Error("mesh",
                  fmt::format("face {} has a vertex id outside 0..{}", f, mesh.NumVertices() - 1),
                  remedy);
    }
  }
}

bool HasNoArea(const TriangleMesh& mesh, Eigen::Index face) {
  const Eigen::Vector3d a = mesh.vertices.col(mesh.faces(0, face));
  const Eigen::Vector3d b = mesh.vertices.col(mesh.faces(1, face));
  const Eigen::Vector3d c = mesh.vertices.col(mesh.faces(2, face));
  const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
  return !((b - a).cross(c - a).norm() > kFlat * longest * longest);
}

std::vector<int> FirstAtSamePlace(const Eigen::Matrix3Xd& vertices) {
  std::vector<int> order(vertices.cols());
  std::iota(order.begin(), order.end(), 0);
  const auto place = [&](int v) {
    return std::tuple(vertices(0, v), vertices(1, v), vertices(2, v));
  };
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    const auto place_a = place(a);
    const auto place_b = place(b);
    return place_a < place_b || (place_a == place_b && a < b);
  });
  std::vector<int> first(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && place(order[i]) == place(order[i - 1]);
    first[order[i]] = same ? first[order[i - 1]] : order[i];
  }
  return first;
}

Eigen::Index PartTouchingFans(TriangleMesh& mesh) {
  DisjointSets fans = FindFans(mesh.faces, EdgeTable(mesh.faces, mesh.NumVertices()));
  return PartFans(fans, mesh);
}

Eigen::Index OrientConsistently(TriangleMesh& mesh) {
  const int num_faces = static_cast<int>(mesh.NumFaces());
  // Per corner: the opposite corner across its edge, if the edge has two faces.
  std::vector<int> opposite(3 * num_faces, kNone);
  EdgeTable(mesh.faces, mesh.NumVertices()).ForEach([&](int, int, std::span<const int> sides) {
    if (sides.size() != 2) return;
    opposite[sides[0]] = sides[1];
    opposite[sides[1]] = sides[0];
  });
  const auto start = [&](int corner) { return mesh.faces(corner % 3, corner / 3); };
  std::vector<signed char> turn(num_faces, -1);  // -1: not visited; relative to the first face
  std::vector<int> patch;
  std::vector<int> to_flip;
  for (int seed = 0; seed < num_faces; ++seed) {
    if (turn[seed] >= 0) continue;
    patch.assign(1, seed);
    turn[seed] = 0;
    std::size_t num_turned = 0;
    for (std::size_t i = 0; i < patch.size(); ++i) {
      const int f = patch[i];
      num_turned += turn[f] == 1;
      for (int k = 0; k < 3; ++k) {
        const int other = opposite[3 * f + k];
        if (other < 0 || turn[other / 3] >= 0) continue;
        const bool disagree = start(3 * f + k) == start(other);
        turn[other / 3] = static_cast<signed char>(turn[f] ^ static_cast<int>(disagree));
        patch.push_back(other / 3);
      }
    }
    const int minority = 2 * num_turned > patch.size() ? 0 : 1;
    for (const int f : patch) {
      if (turn[f] == minority) to_flip.push_back(f);
    }
  }
  for (const int f : to_flip) FlipFace(mesh.faces, f);
  return static_cast<Eigen::Index>(to_flip.size());
}

std::vector<std::string> PartSheets(TriangleMesh& mesh) {
  Eigen::Index split = 0;  // edges of three or more faces at which sheets were separated
  Eigen::Index cut = 0;    // edges along which a one-sided surface was cut
  // The first round pairs sides and splits. If joined patches turn out to be one-sided, or a fan
  // still contains both ends of an edge twice, the next round splits all sheets there.
  for (bool pair = true;; pair = false) {
    const EdgeTable edges(mesh.faces, mesh.NumVertices());
    const auto start = [&](int side) { return mesh.faces(side % 3, side / 3); };
    const auto joined = [&](std::span<const int> sides) {
      return sides.size() == 2 && start(sides[0]) != start(sides[1]);
    };
    DisjointSets patches(static_cast<int>(mesh.NumFaces()));
    edges.ForEach([&](int, int, std::span<const int> sides) {
      if (joined(sides)) patches.Merge(sides[0] / 3, sides[1] / 3);
    });
    std::vector<int> partner(static_cast<std::size_t>(mesh.faces.size()), kNone);
    bool manifold = true;
    edges.ForEach([&](int, int, std::span<const int> sides) {
      if (joined(sides)) {
        partner[sides[0]] = sides[1];
        partner[sides[1]] = sides[0];
      } else if (sides.size() > 1) {
        manifold = false;
        if (pair) (sides.size() > 2 ? split : cut) += 1;
        if (pair && sides.size() > 2) PairSides(mesh, sides, patches, partner);
      }
    });
    if (manifold) break;
    DisjointSets fans(static_cast<int>(mesh.faces.size()));
    for (int side = 0; side < static_cast<int>(partner.size()); ++side) {
      const int other = partner[side];
      if (other < side) continue;
      const auto next = [](int c) { return c / 3 * 3 + (c + 1) % 3; };
      const bool agree = start(side) != start(other);
      fans.Merge(side, agree ? next(other) : other);
      fans.Merge(next(side), agree ? other : next(other));
    }
    PartFans(fans, mesh);
    OrientConsistently(mesh);
  }
  std::vector<std::string> notes;
  const auto edges = [](Eigen::Index n) { return fmt::format("{} edge{}", n, n == 1 ? "" : "s"); };
  if (split > 0) {
    notes.push_back(
        fmt::format("Split the surface along {} of more than two faces.", edges(split)));
  }
  if (cut > 0) {
    notes.push_back(
        fmt::format("Cut the surface along {}: it has only one side there (it is twisted like a "
                    "Moebius strip).",
                    edges(cut)));
  }
  return notes;
}

void DropUnreferenced(TriangleMesh& mesh) {
  std::vector<int> new_id(mesh.NumVertices(), -1);
  for (const int v : mesh.faces.reshaped()) new_id[v] = 0;
  int kept = 0;
  for (int v = 0; v < mesh.NumVertices(); ++v) {
    if (new_id[v] < 0) continue;
    new_id[v] = kept++;
    mesh.vertices.col(new_id[v]) = mesh.vertices.col(v);
  }
  mesh.vertices.conservativeResize(Eigen::NoChange, kept);
  for (int& v : mesh.faces.reshaped()) v = new_id[v];
}

MeshParts FindParts(const TriangleMesh& mesh) {
  const int num_faces = static_cast<int>(mesh.NumFaces());
  DisjointSets sets(num_faces);
  const EdgeTable edges(mesh.faces, mesh.NumVertices());
  edges.ForEach([&](int, int, std::span<const int> sides) {
    for (const int side : sides) sets.Merge(sides[0] / 3, side / 3);
  });

  MeshParts result;
  result.part_of_face.assign(num_faces, -1);
  for (int f = 0; f < num_faces; ++f) {
    if (HasRepeatedCorner(mesh.faces.col(f))) continue;
    const int root = sets.Find(f);  // the first face of the part
    if (root == f) {
      result.part_of_face[f] = static_cast<int>(result.parts.size());
      MeshPart part;
      part.first_face = f;
      part.min = part.max = mesh.vertices.col(mesh.faces(0, f));
      result.parts.push_back(part);
    }
    result.part_of_face[f] = result.part_of_face[root];
    MeshPart& part = result.parts[result.part_of_face[f]];
    // Relative to a corner of the part, since the origin may be far away.
    const Eigen::Vector3d origin = mesh.vertices.col(mesh.faces(0, part.first_face));
    Eigen::Matrix3d corner;
    for (int k = 0; k < 3; ++k) {
      corner.col(k) = mesh.vertices.col(mesh.faces(k, f));
      part.min = part.min.cwiseMin(corner.col(k));
      part.max = part.max.cwiseMax(corner.col(k));
      corner.col(k) -= origin;
    }
    part.volume_m3 += corner.determinant() / 6.0;
  }
  edges.ForEach([&](int, int, std::span<const int> sides) {
    MeshPart& part = result.parts[result.part_of_face[sides[0] / 3]];
    if (sides.size() != 2) {
      part.closed = false;
    } else if (mesh.faces(sides[0] % 3, sides[0] / 3) == mesh.faces(sides[1] % 3, sides[1] / 3)) {
      part.consistent = false;
    }
  });
  FindNesting(mesh, result);
  return result;
}

}  // namespace holdfast
