// SPDX-License-Identifier: MIT
#include "geometry/mesh/mesh_topology.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

namespace holdfast {

DisjointSets::DisjointSets(int n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0); }

int DisjointSets::Find(int element) {
  while (parent_[element] != element) {
    parent_[element] = parent_[parent_[element]];
    element = parent_[element];
  }
  return element;
}

void DisjointSets::Merge(int a, int b) {
  a = Find(a);
  b = Find(b);
  if (a < b) {
    parent_[b] = a;
  } else {
    parent_[a] = b;
  }
}

EdgeTable::EdgeTable(const Eigen::Matrix3Xi& faces, Eigen::Index num_vertices)
    : begin_(num_vertices + 1, 0) {
  const auto for_each_side = [&](auto&& visit) {
    for (int f = 0; f < faces.cols(); ++f) {
      if (HasRepeatedCorner(faces.col(f))) continue;
      for (int k = 0; k < 3; ++k) {
        const int a = faces(k, f);
        const int b = faces((k + 1) % 3, f);
        visit(std::min(a, b), std::max(a, b), 3 * f + k);
      }
    }
  };
  // Counting sort by the lower vertex; the few sides at each vertex are sorted separately.
  for_each_side([&](int low, int, int) { ++begin_[low + 1]; });
  std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
  sides_.resize(begin_.back());
  std::vector<int> next(begin_.begin(), begin_.end() - 1);
  for_each_side([&](int low, int high, int corner) { sides_[next[low]++] = {high, corner}; });
  for (Eigen::Index v = 0; v < num_vertices; ++v) {
    std::sort(sides_.begin() + begin_[v], sides_.begin() + begin_[v + 1]);
  }
}

EdgeCounts CountEdges(const Eigen::Matrix3Xi& faces, const EdgeTable& edges) {
  EdgeCounts counts;
  edges.ForEach([&](int, int, std::span<const int> sides) {
    const auto start = [&](int corner) { return faces(corner % 3, corner / 3); };
    ++counts.all;
    counts.boundary += sides.size() == 1;
    counts.non_manifold += sides.size() > 2;
    counts.misoriented += sides.size() == 2 && start(sides[0]) == start(sides[1]);
  });
  return counts;
}

DisjointSets FindFans(const Eigen::Matrix3Xi& faces, const EdgeTable& edges) {
  DisjointSets fans(static_cast<int>(faces.size()));
  edges.ForEach([&](int low, int high, std::span<const int> sides) {
    for (const int vertex : {low, high}) {
      const auto corner_of = [&](int side) {
        return faces(side % 3, side / 3) == vertex ? side : side / 3 * 3 + (side + 1) % 3;
      };
      for (const int side : sides) fans.Merge(corner_of(sides[0]), corner_of(side));
    }
  });
  return fans;
}

std::pair<std::vector<int>, std::vector<int>> CornersByVertex(const Eigen::Matrix3Xi& faces,
                                                              Eigen::Index num_vertices) {
  std::vector<int> begin(static_cast<std::size_t>(num_vertices) + 1, 0);
  for (const int v : faces.reshaped()) ++begin[v + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<int> corners(static_cast<std::size_t>(faces.size())), next = begin;
  for (int k = 0; k < faces.size(); ++k) corners[next[faces(k)]++] = k;
  return {std::move(begin), std::move(corners)};
}

namespace {

double CornerAngle(const TriangleMesh& mesh, int corner) {
  const int f = corner / 3;
  const Eigen::Vector3d at = mesh.vertices.col(mesh.faces(corner % 3, f));
  const Eigen::Vector3d a = mesh.vertices.col(mesh.faces((corner + 1) % 3, f)) - at;
  const Eigen::Vector3d b = mesh.vertices.col(mesh.faces((corner + 2) % 3, f)) - at;
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace

ShadedMesh SplitAtCreases(const TriangleMesh& mesh, double crease_rad) {
  const auto [begin, corners] = CornersByVertex(mesh.faces, mesh.NumVertices());
  Eigen::Matrix3Xd face_normals(3, mesh.NumFaces());  // zero for faces without area
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    face_normals.col(f) = FaceCross(mesh, f).normalized();
  }
  const double least_cosine = std::cos(crease_rad);
  ShadedMesh result;
  result.mesh.faces.resize(3, mesh.NumFaces());
  std::vector<Eigen::Vector3d> positions, normals;
  for (Eigen::Index v = 0; v < mesh.NumVertices(); ++v) {
    const int first = begin[v];
    const int last = begin[v + 1];
    // Faces are grouped through chains of gentle angles: a cone's rim stays round, and the grouping
    // does not depend on the starting face.
    std::vector<int> group_of(last - first, -1);
    int num_groups = 0;
    for (int seed = 0; seed < last - first; ++seed) {
      if (group_of[seed] >= 0) continue;
      std::vector<int> open{seed};
      group_of[seed] = num_groups;
      while (!open.empty()) {
        const auto normal = face_normals.col(corners[first + open.back()] / 3);
        open.pop_back();
        for (int other = 0; other < last - first; ++other) {
          if (group_of[other] >= 0) continue;
          const auto candidate = face_normals.col(corners[first + other] / 3);
          if (normal.dot(candidate) < least_cosine) continue;
          group_of[other] = num_groups;
          open.push_back(other);
        }
      }
      ++num_groups;
    }
    const auto base = static_cast<int>(positions.size());
    normals.resize(normals.size() + num_groups, Eigen::Vector3d::Zero());
    positions.resize(positions.size() + num_groups, mesh.vertices.col(v));
    for (int k = first; k < last; ++k) {
      const int corner = corners[k];
      const int vertex = base + group_of[k - first];
      result.mesh.faces(corner % 3, corner / 3) = vertex;
      normals[vertex] += CornerAngle(mesh, corner) * face_normals.col(corner / 3);
    }
  }
  const auto count = static_cast<Eigen::Index>(positions.size());
  result.mesh.vertices.resize(3, count);
  result.normals.resize(3, count);
  for (Eigen::Index v = 0; v < count; ++v) {
    result.mesh.vertices.col(v) = positions[v];
    const double length = normals[v].norm();
    result.normals.col(v) =
        length > 1e-12 ? Eigen::Vector3d(normals[v] / length) : Eigen::Vector3d::UnitZ();
  }
  return result;
}

}  // namespace holdfast
