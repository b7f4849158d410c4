// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <utility>

#include <Eigen/Core>

#include "solver/unknowns/vertex_term.h"

namespace holdfast {

/// A hand that is to be where another hand, or another object, had it.
///
///   E = sum_i w_i |z_i - x_i|^2
///
/// Residuals z_i - x_i, metres, in the object's frame, three for each vertex; x_i is the vertex's
/// goal and w_i (no unit) what it counts. Never returns false. Weight: on the sum.
class VertexGoals final : public VertexTerm {
 public:
  /// `goals` (3 x N) in the object's frame, `weights` (N), zero for vertices without a goal.
  VertexGoals(Eigen::Matrix3Xd goals, Eigen::VectorXd weights, double weight)
      : goals_(std::move(goals)), weights_(std::move(weights)), weight_(weight) {}

  double Add(const Eigen::Matrix3Xd& z, std::span<VertexQuadratic> quadratics) const override {
    double energy = 0.0;
    for (Eigen::Index i = 0; i < goals_.cols(); ++i) {
      if (weights_(i) == 0.0) continue;
      const Eigen::Vector3d difference = z.col(i) - goals_.col(i);
      const double squares = weights_(i) * difference.squaredNorm();
      VertexQuadratic& quadratic = quadratics[static_cast<std::size_t>(i)];
      quadratic.hessian.diagonal().array() += weight_ * weights_(i);
      quadratic.gradient += weight_ * weights_(i) * difference;
      quadratic.cost += 0.5 * weight_ * squares;
      energy += squares;
    }
    return energy;
  }

 private:
  Eigen::Matrix3Xd goals_;
  Eigen::VectorXd weights_;
  double weight_;
};

}  // namespace holdfast
