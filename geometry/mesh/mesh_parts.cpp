// SPDX-License-Identifier: MIT
#include "geometry/mesh/mesh_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <tuple>

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

/// Fills `enclosed_by`. Only pairs of nested boxes are looked at; a part's first vertex stands for
/// it.
void FindNesting(const TriangleMesh& mesh, MeshParts& parts) {
  std::vector<int> solids;
  for (std::size_t p = 0; p < parts.parts.size(); ++p) {
    if (parts.parts[p].closed && parts.parts[p].consistent) solids.push_back(static_cast<int>(p));
  }
  if (solids.size() < 2) return;
  // The largest boxes first: a part can only lie in one before it.
  const auto box_volume = [&](int p) { return (parts.parts[p].max - parts.parts[p].min).prod(); };
  std::stable_sort(solids.begin(), solids.end(),
                   [&](int a, int b) { return box_volume(a) > box_volume(b); });
  std::vector<int> begin(parts.parts.size() + 1, 0);  // faces of each part, ascending
  for (const int part : parts.part_of_face) {
    if (part >= 0) ++begin[part + 1];
  }
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<int> faces(begin.back());
  std::vector<int> next(begin.begin(), begin.end() - 1);
  for (std::size_t f = 0; f < parts.part_of_face.size(); ++f) {
    if (parts.part_of_face[f] >= 0) faces[next[parts.part_of_face[f]]++] = static_cast<int>(f);
  }
  std::vector<std::unique_ptr<WindingNumber>> winding(parts.parts.size());
  const auto winding_of = [&](int part) -> const WindingNumber& {
    if (!winding[part]) {
      TriangleMesh piece;
      piece.vertices.resize(3, 3 * parts.parts[part].num_faces);
      piece.faces.resize(3, parts.parts[part].num_faces);
      for (int i = 0; i < piece.NumFaces(); ++i) {
        for (int k = 0; k < 3; ++k) {
          piece.vertices.col(3 * i + k) = mesh.vertices.col(mesh.faces(k, faces[begin[part] + i]));
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

Eigen::Index CountDuplicateVertices(const Eigen::Matrix3Xd& vertices) {
  const std::vector<int> first = FirstAtSamePlace(vertices);
  Eigen::Index count = 0;
  for (std::size_t v = 0; v < first.size(); ++v) count += first[v] != static_cast<int>(v);
  return count;
}

std::vector<bool> DuplicateFaces(const Eigen::Matrix3Xi& faces) {
  struct Key {
    std::array<int, 3> corners;
    int face;
  };
  std::vector<Key> keys(faces.cols());
  for (int f = 0; f < faces.cols(); ++f) {
    keys[f] = {{faces(0, f), faces(1, f), faces(2, f)}, f};
    std::sort(keys[f].corners.begin(), keys[f].corners.end());
  }
  std::sort(keys.begin(), keys.end(), [](const Key& a, const Key& b) {
    return std::tie(a.corners, a.face) < std::tie(b.corners, b.face);
  });
  std::vector<bool> duplicate(faces.cols(), false);
  for (std::size_t i = 1; i < keys.size(); ++i) {
    if (keys[i].corners == keys[i - 1].corners) duplicate[keys[i].face] = true;
  }
  return duplicate;
}

Eigen::Index CountDuplicateFaces(const Eigen::Matrix3Xi& faces) {
  const std::vector<bool> duplicate = DuplicateFaces(faces);
  return std::count(duplicate.begin(), duplicate.end(), true);
}

Eigen::Index PartTouchingFans(TriangleMesh& mesh) {
  DisjointSets fans = FindFans(mesh.faces, EdgeTable(mesh.faces, mesh.NumVertices()));
  std::vector<int> vertex_of_fan(3 * mesh.NumFaces(), -1);
  std::vector<bool> taken(mesh.NumVertices(), false);
  std::vector<int> added;  // the vertex each copies
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
    ++part.num_faces;
    // From a corner of the part rather than the origin, which may be far away.
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
