// SPDX-License-Identifier: MIT
#include "geometry/body/own_body.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <span>
#include <tuple>

#include <Eigen/Geometry>

#include "geometry/mesh/mesh_topology.h"
#include "geometry/mesh/triangle_tree.h"

namespace holdfast {
namespace {

constexpr int kFacesPerLeaf = 8;

// Fraction of a vertex's weight on an arm from `first` on: 0 shoulder, 1 elbow, 2 wrist.
double ShareOfArm(const BodySurface& body, int vertex, Side side, int first) {
  double share = 0.0;
  for (const auto& [joint, weight] : body.Weights(vertex)) {
    bool arm = IsFinger(joint, side);
    for (int k = first; k < 3; ++k) arm = arm || joint == WristJoint(side) - 4 + 2 * k;
    if (arm) share += weight;
  }
  return share;
}

}  // namespace

// Bounding volume hierarchy over faces: topology from the rest pose, boxes from each pose.
struct OwnBody::Tree {
  struct Node {
    int second = 0;                         // the first child follows its parent; 0: a leaf
    int begin = 0, end = 0;                 // of `faces`
    int first_corner = 0, last_corner = 0;  // of `corners`, for a leaf
  };

  std::vector<Eigen::Vector3i> faces;      // corners, leaf by leaf
  std::vector<bool> vertex_rim;            // per body vertex
  std::vector<std::array<int, 3>> across;  // the face across each edge; -1 at the rim
  std::vector<int> around_begin, around;   // faces at each vertex
  std::vector<Node> nodes;
  std::vector<int> corners;  // distinct vertices of each leaf's faces

  void Build(const Eigen::Matrix3Xd& rest, std::vector<Eigen::Vector3i>& unordered) {
    std::vector<Eigen::Vector3d> centers;
    for (const Eigen::Vector3i& f : unordered) {
      centers.push_back((rest.col(f[0]) + rest.col(f[1]) + rest.col(f[2])) / 3.0);
    }
    std::vector<int> order(unordered.size());
    std::iota(order.begin(), order.end(), 0);
    if (!order.empty()) Split(centers, order, 0, static_cast<int>(order.size()));
    for (const int f : order) faces.push_back(unordered[f]);
    for (Node& node : nodes) {
      if (node.second != 0) continue;
      std::set<int> own;
      for (int f = node.begin; f < node.end; ++f) own.insert(faces[f].begin(), faces[f].end());
      node.first_corner = static_cast<int>(corners.size());
      corners.insert(corners.end(), own.begin(), own.end());
      node.last_corner = static_cast<int>(corners.size());
    }
    Join(rest.cols());
  }

 private:
  void Split(const std::vector<Eigen::Vector3d>& centers, std::vector<int>& order, int begin,
             int end) {
    const std::size_t node = nodes.size();
    nodes.push_back({.begin = begin, .end = end});
    if (end - begin <= kFacesPerLeaf) return;
    Eigen::AlignedBox3d box;
    for (int i = begin; i < end; ++i) box.extend(centers[order[i]]);
    Eigen::Index axis;
    box.sizes().maxCoeff(&axis);
    const int middle = begin + (end - begin) / 2;
    std::nth_element(order.begin() + begin, order.begin() + middle, order.begin() + end,
                     [&](int a, int b) {
                       return std::pair(centers[a][axis], a) < std::pair(centers[b][axis], b);
                     });
    Split(centers, order, begin, middle);
    nodes[node].second = static_cast<int>(nodes.size());
    Split(centers, order, middle, end);
  }

  void Join(Eigen::Index num_vertices) {
    Eigen::Matrix3Xi table(3, static_cast<Eigen::Index>(faces.size()));
    for (std::size_t f = 0; f < faces.size(); ++f)
      table.col(static_cast<Eigen::Index>(f)) = faces[f];
    across.assign(faces.size(), {-1, -1, -1});
    vertex_rim.assign(static_cast<std::size_t>(num_vertices), false);
    EdgeTable(table, num_vertices).ForEach([&](int low, int high, std::span<const int> sides) {
      if (sides.size() == 2) {
        across[sides[0] / 3][sides[0] % 3] = sides[1] / 3;
        across[sides[1] / 3][sides[1] % 3] = sides[0] / 3;
      } else {
        vertex_rim[low] = vertex_rim[high] = true;
      }
    });
    std::tie(around_begin, around) = CornersByVertex(table, num_vertices);
    for (int& corner : around) corner /= 3;
  }
};

OwnBody::OwnBody(const BodySurface& body, std::uint8_t left_out) {
  std::vector<bool> gone(static_cast<std::size_t>(body.NumVertices()), false);
  for (int i = 0; i < body.NumVertices(); ++i) {
    for (const Side side : {Side::kRight, Side::kLeft}) {
      const bool counts = (left_out & (side == Side::kRight ? 1 : 2)) == 0;
      if (!counts && ShareOfArm(body, i, side, 0) > 0.5) gone[i] = true;
    }
  }
  std::vector<Eigen::Vector3i> faces;
  for (Eigen::Index f = 0; f < body.Faces().cols(); ++f) {
    const Eigen::Vector3i face = body.Faces().col(f);
    if (HasRepeatedCorner(face) || gone[face[0]] || gone[face[1]] || gone[face[2]]) continue;
    faces.push_back(face);
  }
  auto tree = std::make_shared<Tree>();
  tree->Build(body.RestVertices(), faces);
  tree_ = std::move(tree);
}

std::vector<int> OwnBody::ForearmAndHand(const BodySurface& body, Side side) {
  constexpr double kFromElbow_m = 0.08;
  const Eigen::Vector3d elbow = body.RestJoints().col(WristJoint(side) - 2);
  std::vector<int> vertices;
  for (int i = 0; i < body.NumVertices(); ++i) {
    if (ShareOfArm(body, i, side, 1) > 0.5 &&
        (body.RestVertices().col(i) - elbow).norm() >= kFromElbow_m) {
      vertices.push_back(i);
    }
  }
  return vertices;
}

struct OwnBody::Posed::Impl {
  std::shared_ptr<const Tree> tree;
  const Eigen::Matrix3Xd& vertices;
  double farthest2 = 0.0;                  // squared, meters
  std::vector<Eigen::AlignedBox3d> boxes;  // of the nodes; empty if too far

  struct Nearest {
    double distance2;
    int face = -1;
    TrianglePoint at;
  };

  void Search(int node, const Eigen::Vector3d& point, Nearest& nearest) const {
    const Tree::Node& n = tree->nodes[node];
    if (n.second == 0) {
      for (int f = n.begin; f < n.end; ++f) {
        const Eigen::Vector3i& face = tree->faces[f];
        const TrianglePoint at = ClosestOnTriangle(point, vertices.col(face[0]),
                                                   vertices.col(face[1]), vertices.col(face[2]));
        const double distance2 = (point - at.point).squaredNorm();
        if (distance2 < nearest.distance2) nearest = {distance2, f, at};
      }
      return;
    }
    std::array<int, 2> child = {node + 1, n.second};
    std::array<double, 2> bound;
    for (const int k : {0, 1}) bound[k] = Bound(child[k], point);
    if (bound[1] < bound[0]) {
      std::swap(child[0], child[1]);
      std::swap(bound[0], bound[1]);
    }
    for (const int k : {0, 1}) {
      if (bound[k] < nearest.distance2) Search(child[k], point, nearest);
    }
  }

  // Squared distance to the node's box; infinite for an empty box. Branch-free.
  double Bound(int node, const Eigen::Vector3d& point) const {
    const Eigen::AlignedBox3d& box = boxes[node];
    double squared = 0.0;
    for (int k = 0; k < 3; ++k) {
      const double off = std::max(0.0, std::max(box.min()[k] - point[k], point[k] - box.max()[k]));
      squared += off * off;
    }
    return squared;
  }

  Eigen::Vector3d Cross(int face) const {
    const Eigen::Vector3i& f = tree->faces[face];
    const Eigen::Vector3d a = vertices.col(f[0]);
    return (vertices.col(f[1]) - a).cross(vertices.col(f[2]) - a);
  }

  // Angle-weighted pseudonormal (Baerentzen & Aanaes 2005); nothing on the rim.
  std::optional<Eigen::Vector3d> Normal(const Nearest& nearest) const {
    using enum TriangleFeature;
    const Eigen::Vector3i& face = tree->faces[nearest.face];
    switch (nearest.at.feature) {
      case kFace:
        return Cross(nearest.face).stableNormalized();
      case kVertex0:
      case kVertex1:
      case kVertex2:
        return VertexNormal(
            face[static_cast<int>(nearest.at.feature) - static_cast<int>(kVertex0)]);
      default: {
        const int edge = static_cast<int>(nearest.at.feature) - static_cast<int>(kEdge01);
        const int other = tree->across[nearest.face][edge];
        if (other < 0) return std::nullopt;
        const Eigen::Vector3d sum =
            Cross(nearest.face).stableNormalized() + Cross(other).stableNormalized();
        return sum.stableNormalized();
      }
    }
  }

  std::optional<Eigen::Vector3d> VertexNormal(int vertex) const {
    if (tree->vertex_rim[vertex]) return std::nullopt;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int i = tree->around_begin[vertex]; i < tree->around_begin[vertex + 1]; ++i) {
      const Eigen::Vector3i& face = tree->faces[tree->around[i]];
      const int k = face[0] == vertex ? 0 : face[1] == vertex ? 1 : 2;
      const Eigen::Vector3d a = vertices.col(face[(k + 1) % 3]) - vertices.col(vertex);
      const Eigen::Vector3d b = vertices.col(face[(k + 2) % 3]) - vertices.col(vertex);
      const Eigen::Vector3d cross = a.cross(b);
      sum += std::atan2(cross.norm(), a.dot(b)) * cross.stableNormalized();
    }
    return sum.stableNormalized();
  }
};

OwnBody::Posed::Posed(const OwnBody& body, const Eigen::Matrix3Xd& vertices,
                      const Eigen::Vector3d& low, const Eigen::Vector3d& high, double margin_m) {
  std::unique_ptr<Impl> impl(new Impl{body.tree_, vertices, margin_m * margin_m, {}});
  const Eigen::AlignedBox3d asked(low, high);
  const Tree& tree = *body.tree_;
  impl->boxes.resize(tree.nodes.size());
  for (int n = static_cast<int>(tree.nodes.size()) - 1; n >= 0; --n) {
    const Tree::Node& node = tree.nodes[n];
    Eigen::AlignedBox3d& box = impl->boxes[n];
    if (node.second != 0) {
      box = impl->boxes[n + 1].merged(impl->boxes[node.second]);
      continue;
    }
    // x and y side by side, all in registers.
    using Two [[gnu::vector_size(16)]] = double;
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    Two low_xy = {kInfinity, kInfinity}, high_xy = -low_xy;
    double low_z = kInfinity, high_z = -low_z;
    for (int k = node.first_corner; k < node.last_corner; ++k) {
      const double* const p = vertices.col(tree.corners[k]).data();
      const Two xy = {p[0], p[1]};
      low_xy = xy < low_xy ? xy : low_xy;
      high_xy = xy > high_xy ? xy : high_xy;
      low_z = p[2] < low_z ? p[2] : low_z;
      high_z = p[2] > high_z ? p[2] : high_z;
    }
    box = Eigen::AlignedBox3d(Eigen::Vector3d(low_xy[0], low_xy[1], low_z),
                              Eigen::Vector3d(high_xy[0], high_xy[1], high_z));
    if (box.squaredExteriorDistance(asked) > impl->farthest2) box.setEmpty();
  }
  impl_ = std::move(impl);
}

OwnBody::Posed::~Posed() = default;

std::optional<OwnBody::Touch> OwnBody::Posed::Query(const Eigen::Vector3d& point,
                                                    double within_m) const {
  Impl::Nearest nearest{std::min(impl_->farthest2, within_m * within_m), -1, {}};
  if (!impl_->boxes.empty() && impl_->Bound(0, point) < nearest.distance2) {
    impl_->Search(0, point, nearest);
  }
  if (nearest.face < 0) return std::nullopt;
  const std::optional<Eigen::Vector3d> normal = impl_->Normal(nearest);
  if (!normal) return std::nullopt;
  const double distance = std::sqrt(nearest.distance2);
  const bool inside = (point - nearest.at.point).dot(*normal) < 0.0;
  return Touch{inside ? distance : -distance, nearest.at.point, *normal};
}

}  // namespace holdfast
