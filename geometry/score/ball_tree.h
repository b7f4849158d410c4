// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace holdfast {

/// Points (3 x n, copied) in a tree of balls around halves of them: what is far from a surface is
/// left out ball by ball.
class BallTree {
 public:
  explicit BallTree(Eigen::Matrix3Xd points)
      : points_(std::move(points)), order_(static_cast<std::size_t>(points_.cols())) {
    std::iota(order_.begin(), order_.end(), 0);
    if (!order_.empty()) Build(0, 0, static_cast<int>(order_.size()));
  }

  const Eigen::Matrix3Xd& Points() const { return points_; }
  std::size_t NumBalls() const { return balls_.size(); }

  /// Calls visit(column) for the points of every ball that reaches(center, radius, ball) is true
  /// for, and for those around it; the order is always the same. `ball` is below NumBalls().
  template <typename Reaches, typename Visit>
  void ForPoints(const Reaches& reaches, const Visit& visit) const {
    if (!order_.empty()) Descend(0, 0, static_cast<int>(order_.size()), reaches, visit);
  }

 private:
  static constexpr int kLeaf = 4;
  struct Ball {
    Eigen::Vector3d center;
    double radius = 0.0;
  };

  void Build(std::size_t node, int begin, int end) {
    if (balls_.size() <= node) balls_.resize(node + 1);
    Eigen::AlignedBox3d box;
    for (int i = begin; i < end; ++i) box.extend(points_.col(order_[i]));
    balls_[node].center = box.center();
    for (int i = begin; i < end; ++i) {
      balls_[node].radius =
          std::max(balls_[node].radius, (points_.col(order_[i]) - box.center()).norm());
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
    if (!reaches(balls_[node].center, balls_[node].radius, node)) return;
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
  std::vector<Ball> balls_;  // children of i: 2 i + 1, 2 i + 2
};

}  // namespace holdfast
