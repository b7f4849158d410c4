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

}  // namespace holdfast
