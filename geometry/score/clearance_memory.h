// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/score/exact_intersection.h"

namespace holdfast {

/// Whether a closed surface encloses a point: a ray from the point crosses more faces outwards than
/// inwards. For self-intersecting surfaces, where the nearest face alone does not decide.
bool GoesAround(const Solid& closed, const Eigen::Vector3d& point);

/// Caches the last known distances of numbered points from a solid, and derives bounds on their
/// distances after small motions of the points or the solid: from frame to frame most points need
/// no new query. That a point is outside is also cached, as long as no surface can have passed it.
class ClearanceMemory {
 public:
  /// Keeps a reference to `solid`. For points 0 to `points` - 1.
  ClearanceMemory(const Solid& solid, std::size_t points) : solid_(solid), known_(points) {}

  /// Reports a motion of the solid's surface; no surface point moved farther than this, meters.
  void SurfaceMoved(double farthest_m) { traveled_ += farthest_m; }

  /// Lower bound of the distance of point i, now at `point`, outside the solid, meters. Zero or
  /// less if unknown, as near the holes of a solid that is not closed.
  double OutsideBy(std::size_t i, const Eigen::Vector3d& point) const {
    return Clear(known_[i]) - (point - known_[i].place).norm();
  }

  /// Upper bound of the distance from the surface, inside or outside; infinity if unknown.
  double AtMost(std::size_t i, const Eigen::Vector3d& point) const {
    const Known& k = known_[i];
    return k.distance + (traveled_ - k.traveled) + (point - k.place).norm();
  }

  /// Queries the solid and caches the result. The point is outside if the surface does not enclose
  /// it, even if the back of the nearest face is seen.
  SignedDistance::Result Query(std::size_t i, const Eigen::Vector3d& point);

 private:
  struct Known {
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    double distance = std::numeric_limits<double>::infinity();
    double clear = 0.0;     // lower bound of the distance outside
    double traveled = 0.0;  // of the surface, at the time of the query
    int face = -1;
  };

  double Clear(const Known& k) const {
    return k.clear > 0.0 ? k.clear - (traveled_ - k.traveled) : 0.0;
  }

  const Solid& solid_;
  std::vector<Known> known_;
  double traveled_ = 0.0;
};

/// Points (3 x n, copied) in a binary tree of bounding balls: points far from a surface are culled
/// ball by ball.
class BallTree {
 public:
  explicit BallTree(Eigen::Matrix3Xd points)
      : points_(std::move(points)), order_(static_cast<std::size_t>(points_.cols())) {
    std::iota(order_.begin(), order_.end(), 0);
    if (!order_.empty()) Build(0, 0, static_cast<int>(order_.size()));
  }

  const Eigen::Matrix3Xd& Points() const { return points_; }
  std::size_t NumBalls() const { return balls_.size(); }

  /// Calls visit(column) for the points of every ball for which reaches(center, radius, ball) is
  /// true for the ball and its ancestors. The order is always the same. `ball` is below NumBalls().
  template <typename Reaches, typename Visit>
  void ForPoints(const Reaches& reaches, const Visit& visit) const {
    if (!order_.empty()) Descend(0, 0, static_cast<int>(order_.size()), reaches, visit);
  }

 private:
  static constexpr int kLeaf = 4;

  void Build(std::size_t node, int begin, int end) {
    if (balls_.size() <= node) balls_.resize(node + 1);
    Eigen::AlignedBox3d box;
    for (int i = begin; i < end; ++i) box.extend(points_.col(order_[i]));
    auto& [center, radius] = balls_[node];
    center = box.center();
    for (int i = begin; i < end; ++i) {
      radius = std::max(radius, (points_.col(order_[i]) - box.center()).norm());
    }
    if (end - begin <= kLeaf) return;
    Eigen::Index axis;
    box.sizes().maxCoeff(&axis);
    const int middle = (begin + end) / 2;
    std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                     [&](int a, int b) {
                       return std::pair(points_(axis, a), a) < std::pair(points_(axis, b), b);
                     });
    Build(2 * node + 1, begin, middle);
    Build(2 * node + 2, middle, end);
  }

  template <typename Reaches, typename Visit>
  void Descend(std::size_t node, int begin, int end, const Reaches& reaches,
               const Visit& visit) const {
    if (!reaches(balls_[node].first, balls_[node].second, node)) return;
    if (end - begin <= kLeaf) {
      for (int i = begin; i < end; ++i) visit(order_[i]);
      return;
    }
    const int middle = (begin + end) / 2;
    Descend(2 * node + 1, begin, middle, reaches, visit);
    Descend(2 * node + 2, middle, end, reaches, visit);
  }

  Eigen::Matrix3Xd points_;
  std::vector<int> order_;
  // Centers and radii; children of i: 2 i + 1, 2 i + 2.
  std::vector<std::pair<Eigen::Vector3d, double>> balls_;
};

}  // namespace holdfast
