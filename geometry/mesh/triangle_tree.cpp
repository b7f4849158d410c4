// SPDX-License-Identifier: MIT
#include "geometry/mesh/triangle_tree.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "geometry/error.h"

namespace holdfast {
namespace {

constexpr int kWide = 8;  // children per node, whose boxes are tested with SIMD
constexpr int kLanes = 4;
using Lanes [[gnu::vector_size(4 * kLanes), gnu::may_alias]] = float;
inline Lanes Larger(Lanes a, Lanes b) { return a > b ? a : b; }

// One bit for each lane that is not larger than `most`.
inline unsigned NotLarger(const Lanes& lanes, float most) {
#if defined(__SSE2__)
  return static_cast<unsigned>(_mm_movemask_ps(_mm_cmple_ps(lanes, _mm_set1_ps(most))));
#else
  unsigned bits = 0;
  for (int k = 0; k < kLanes; ++k) bits |= unsigned{lanes[k] <= most} << k;
  return bits;
#endif
}

constexpr float kUlp = 0x1p-23f;

// Rounded down, so that it stays a bound.
float Below(double x) {
  const auto f = static_cast<float>(x);
  return f - kUlp * std::abs(f);
}
float Above(double x) { return -Below(-x); }

}  // namespace

TrianglePoint ClosestOnTriangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  using enum TriangleFeature;
  const Eigen::Vector3d ab = b - a;
  const Eigen::Vector3d ac = c - a;
  const Eigen::Vector3d ap = p - a;
  const double d1 = ab.dot(ap);
  const double d2 = ac.dot(ap);
  if (d1 <= 0.0 && d2 <= 0.0) return {a, kVertex0};

  const Eigen::Vector3d bp = p - b;
  const double d3 = ab.dot(bp);
  const double d4 = ac.dot(bp);
  if (d3 >= 0.0 && d4 <= d3) return {b, kVertex1};

  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return {a + d1 / (d1 - d3) * ab, kEdge01};

  const Eigen::Vector3d cp = p - c;
  const double d5 = ab.dot(cp);
  const double d6 = ac.dot(cp);
  if (d6 >= 0.0 && d5 <= d6) return {c, kVertex2};

  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return {a + d2 / (d2 - d6) * ac, kEdge20};

  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
    return {b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b), kEdge12};
  }
  const double scale = 1.0 / (va + vb + vc);
  return {a + vb * scale * ab + vc * scale * ac, kFace};
}

struct TriangleTree::Impl {
  // The boxes of up to eight children in single precision, rounded outwards, relative to the tree's
  // center. An unused slot has a box that is far from everything.
  struct Node {
    Lanes low[3][kWide / kLanes], high[3][kWide / kLanes];
    std::array<int, kWide> child;  // index of a later node, or ~index of a triangle
    int count = 0;
    unsigned leaves = 0;  // one bit for each child that is a triangle

    float& Low(int axis, int c) { return reinterpret_cast<float*>(low[axis])[c]; }
    float& High(int axis, int c) { return reinterpret_cast<float*>(high[axis])[c]; }
  };

  struct Triangle {
    std::array<Eigen::Vector3d, 3> corners;
    int face;
  };

  // A query in single precision, rounded such that distances to boxes are lower bounds.
  struct BoxQuery {
    explicit BoxQuery(const Eigen::Vector3d& p) {
      for (int k = 0; k < 3; ++k) {
        low[k] = Lanes{} + Below(p[k]);
        high[k] = Lanes{} + Above(p[k]);
      }
    }
    // Squared distances; rounding errors are below the slack of Search.
    void Distances(const Node& node, Lanes* squared) const {
      for (int half = 0; half < kWide / kLanes; ++half) {
        squared[half] = Lanes{};
        for (int k = 0; k < 3; ++k) {
          const Lanes side = Larger(node.low[k][half] - high[k], low[k] - node.high[k][half]);
          const Lanes off = Larger(side, Lanes{});
          squared[half] += off * off;
        }
      }
    }
    Lanes low[3], high[3];
  };

  std::vector<Triangle> triangles;  // in the order of the leaves
  std::vector<int> triangle_of_face;
  std::vector<Node> nodes;  // each node before its children
  Eigen::Vector3d min, max, center;

  int AddNode(std::vector<Eigen::Vector3d>& centers, std::vector<int>& order, int begin, int end);
  void FitBoxes();
  Hit Search(const Eigen::Vector3d& query, int first_triangle) const;
};

// Halves the longest range along its longest axis until there are eight, regardless of how many
// triangles share a corner or a position.
int TriangleTree::Impl::AddNode(std::vector<Eigen::Vector3d>& centers, std::vector<int>& order,
                                int begin, int end) {
  std::vector<std::pair<int, int>> ranges = {{begin, end}};
  while (ranges.size() < kWide) {
    const auto longest = std::ranges::max_element(
        ranges, {}, [](const auto& range) { return range.second - range.first; });
    const auto [from, to] = *longest;
    if (to - from < 2) break;
    Eigen::AlignedBox3d box;
    for (int i = from; i < to; ++i) box.extend(centers[order[i]]);
    Eigen::Index axis;
    box.sizes().maxCoeff(&axis);
    const int middle = (from + to) / 2;
    std::nth_element(order.begin() + from, order.begin() + middle, order.begin() + to,
                     [&](int a, int b) {
                       return std::pair(centers[a][axis], a) < std::pair(centers[b][axis], b);
                     });
    longest->second = middle;
    ranges.emplace_back(middle, to);
  }
  const int id = static_cast<int>(nodes.size());
  nodes.emplace_back();
  int count = 0;
  for (const auto& [from, to] : ranges) {
    const int child = to - from == 1 ? ~from : AddNode(centers, order, from, to);
    if (child < 0) nodes[id].leaves |= 1u << count;
    nodes[id].child[count++] = child;
  }
  nodes[id].count = count;
  return id;
}

void TriangleTree::Impl::FitBoxes() {
  Eigen::AlignedBox3d all;
  for (const Triangle& t : triangles) {
    for (const Eigen::Vector3d& corner : t.corners) all.extend(corner);
  }
  min = all.min();
  max = all.max();
  center = all.center();
  for (auto node = nodes.rbegin(); node != nodes.rend(); ++node) {
    for (int k = 0; k < 3; ++k) {
      for (int c = 0; c < kWide; ++c) {
        float& low = node->Low(k, c) = std::numeric_limits<float>::infinity();
        float& high = node->High(k, c) = -low;
        if (c >= node->count) continue;
        if (node->child[c] < 0) {
          const auto& [p, q, r] = triangles[~node->child[c]].corners;
          low = Below(std::min({p[k], q[k], r[k]}) - center[k]);
          high = Above(std::max({p[k], q[k], r[k]}) - center[k]);
        } else {
          Node& child = nodes[node->child[c]];
          low = *std::min_element(&child.Low(k, 0), &child.Low(k, 0) + kWide);
          high = *std::max_element(&child.High(k, 0), &child.High(k, 0) + kWide);
        }
      }
    }
  }
}

TriangleTree::Hit TriangleTree::Impl::Search(const Eigen::Vector3d& query,
                                             int first_triangle) const {
  Hit best;
  best.squared_distance = std::numeric_limits<double>::infinity();
  // Boxes farther than this are skipped; the slack covers single-precision rounding.
  float farthest = 0.0f;
  const auto limit = [&] {
    farthest = static_cast<float>(best.squared_distance * (1.0 + 0x1p-19));
  };
  // Among equally near faces the first wins: the result does not depend on the search order.
  const auto look_at = [&](int index) {
    const Triangle& t = triangles[index];
    const TrianglePoint on = ClosestOnTriangle(query, t.corners[0], t.corners[1], t.corners[2]);
    const double squared = (query - on.point).squaredNorm();
    const bool as_near = squared == best.squared_distance && (best.face < 0 || t.face < best.face);
    if (!as_near && !(squared < best.squared_distance)) return;
    best = {on.point, on.feature, t.face, squared};
    limit();
  };
  look_at(first_triangle);
  if (best.face < 0) {  // a query that is not finite
    return {query, TriangleFeature::kFace, triangles[first_triangle].face, std::nan("")};
  }
  const BoxQuery boxes(query - center);
  struct Entry {
    float squared;
    int child;
  };
  std::array<Entry, 16 * kWide> stack;  // each level leaves seven: 2^31 triangles have 11 levels
  int top = 0;
  stack[top++] = {0.0f, 0};
  while (top > 0) {
    const Entry entry = stack[--top];
    if (entry.squared > farthest) continue;
    const Node& node = nodes[entry.child];
    Lanes lanes[kWide / kLanes];
    boxes.Distances(node, lanes);
    const auto* const squared = reinterpret_cast<const float*>(lanes);
    unsigned near = 0;
    for (int half = 0; half < kWide / kLanes; ++half) {
      near |= NotLarger(lanes[half], farthest) << (half * kLanes);
    }
    near &= (1u << node.count) - 1;
    for (unsigned left = near & node.leaves; left != 0; left &= left - 1) {
      const int c = std::countr_zero(left);
      if (squared[c] <= farthest) look_at(~node.child[c]);
    }
    const int bottom = top;
    for (unsigned left = near & ~node.leaves; left != 0; left &= left - 1) {
      const int c = std::countr_zero(left);
      if (squared[c] > farthest) continue;
      int place = top++;  // the nearest on top
      for (; place > bottom && stack[place - 1].squared < squared[c]; --place) {
        stack[place] = stack[place - 1];
      }
      stack[place] = {squared[c], node.child[c]};
    }
  }
  return best;
}

TriangleTree::TriangleTree(const TriangleMesh& mesh) : impl_(std::make_unique<Impl>()) {
  if (!mesh.vertices.allFinite()) {
    throw Error("mesh", "has coordinates that are not finite", "Repair the mesh first.");
  }
  std::vector<Impl::Triangle> triangles;
  std::vector<Eigen::Vector3d> centers;
  impl_->triangle_of_face.assign(mesh.NumFaces(), -1);
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    const Eigen::Vector3i face = mesh.faces.col(f);
    if (face.minCoeff() < 0 || face.maxCoeff() >= mesh.NumVertices()) {
      throw Error("mesh", "has faces with vertex ids out of range", "Repair the mesh first.");
    }
    const Eigen::Vector3d a = mesh.vertices.col(face[0]);
    const Eigen::Vector3d b = mesh.vertices.col(face[1]);
    const Eigen::Vector3d c = mesh.vertices.col(face[2]);
    if (!((b - a).cross(c - a).squaredNorm() > 0.0)) continue;
    triangles.push_back({{a, b, c}, static_cast<int>(f)});
    centers.push_back(0.5 * (a.cwiseMin(b).cwiseMin(c) + a.cwiseMax(b).cwiseMax(c)));
  }
  if (triangles.empty()) {
    throw Error("mesh", "has no face with an area", "Give a surface, not a set of points.");
  }
  std::vector<int> order(triangles.size());
  std::iota(order.begin(), order.end(), 0);
  impl_->AddNode(centers, order, 0, static_cast<int>(order.size()));
  for (std::size_t i = 0; i < order.size(); ++i) {
    impl_->triangles.push_back(triangles[order[i]]);
    impl_->triangle_of_face[impl_->triangles.back().face] = static_cast<int>(i);
  }
  impl_->FitBoxes();
}

TriangleTree::~TriangleTree() = default;
TriangleTree::TriangleTree(TriangleTree&&) noexcept = default;
TriangleTree& TriangleTree::operator=(TriangleTree&&) noexcept = default;

void TriangleTree::Move(const TriangleMesh& mesh) {
  for (Impl::Triangle& triangle : impl_->triangles) {
    for (int k = 0; k < 3; ++k) {
      triangle.corners[k] = mesh.vertices.col(mesh.faces(k, triangle.face));
    }
  }
  impl_->FitBoxes();
}

TriangleTree::Hit TriangleTree::Closest(const Eigen::Vector3d& query, int hint_face) const {
  const int hint = hint_face >= 0 ? impl_->triangle_of_face[hint_face] : -1;
  return impl_->Search(query, std::max(hint, 0));
}

std::vector<int> TriangleTree::FacesInBox(const Eigen::Vector3d& low,
                                          const Eigen::Vector3d& high) const {
  std::vector<int> faces, left = {0};
  float from[3], to[3];
  for (int k = 0; k < 3; ++k) {
    from[k] = Below(low[k] - impl_->center[k]);
    to[k] = Above(high[k] - impl_->center[k]);
  }
  while (!left.empty()) {
    Impl::Node& node = impl_->nodes[left.back()];
    left.pop_back();
    for (int c = 0; c < node.count; ++c) {
      bool apart = false;
      for (int k = 0; k < 3; ++k) {
        apart = apart || node.Low(k, c) > to[k] || node.High(k, c) < from[k];
      }
      if (apart) continue;
      if (node.child[c] >= 0) {
        left.push_back(node.child[c]);
      } else {
        faces.push_back(impl_->triangles[~node.child[c]].face);
      }
    }
  }
  std::ranges::sort(faces);
  return faces;
}

const Eigen::Vector3d& TriangleTree::Min() const { return impl_->min; }
const Eigen::Vector3d& TriangleTree::Max() const { return impl_->max; }

}  // namespace holdfast
