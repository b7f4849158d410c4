// SPDX-License-Identifier: MIT
#include "geometry/mesh/mesh_topology.h"

#include <algorithm>
#include <numeric>
#include <tuple>

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
  // A counting sort by the lower vertex; the few sides at each vertex are sorted on their own.
  for_each_side([&](int low, int, int) { ++begin_[low + 1]; });
  std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
  sides_.resize(begin_.back());
  std::vector<int> next(begin_.begin(), begin_.end() - 1);
  for_each_side([&](int low, int high, int corner) { sides_[next[low]++] = {high, corner}; });
  for (Eigen::Index v = 0; v < num_vertices; ++v) {
    std::sort(sides_.begin() + begin_[v], sides_.begin() + begin_[v + 1],
              [](const Side& x, const Side& y) {
                return std::tie(x.high, x.corner) < std::tie(y.high, y.corner);
              });
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

}  // namespace holdfast
