// SPDX-License-Identifier: MIT
#pragma once

#include <deque>

#include <Eigen/Core>

namespace holdfast {

/// What limited-memory BFGS knows of the curvature: the last `history` steps and the change of the
/// gradient along each (Nocedal & Wright 2006, algorithm 7.4).
class LbfgsMemory {
 public:
  explicit LbfgsMemory(int history) : history_(history) {}

  /// A step and the change of the gradient over it. Without noticeable positive curvature
  /// (y.s <= 1e-10) it is not remembered: the approximation stays positive definite.
  void Remember(const Eigen::VectorXd& step, const Eigen::VectorXd& gradient_change);

  /// -H g; steepest descent while nothing is remembered.
  Eigen::VectorXd Direction(const Eigen::VectorXd& gradient) const;

  int Size() const { return static_cast<int>(pairs_.size()); }

 private:
  struct Pair {
    Eigen::VectorXd step, change;
    double curvature;  // y.s
  };
  int history_;
  std::deque<Pair> pairs_;  // the oldest first
};

}  // namespace holdfast
