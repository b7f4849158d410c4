// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>

namespace holdfast {

/// Steps take the time that they are to take: a step later the feet have changed places.
///
///   r = sqrt(w) d . ((a - b) + (a' - b')),   one residual, metres
///
/// Parameter blocks: the ankles a and b in one frame, and a' and b' one step later (3 each, world,
/// metres); d is the direction of the way, of unit length. Shorter and quicker steps at the same
/// speed have feet out of turn there.
class Cadence final : public ceres::SizedCostFunction<1, 3, 3, 3, 3> {
 public:
  Cadence(const Eigen::Vector2d& direction, double weight)
      : along_(std::sqrt(weight) * Eigen::Vector3d(direction.x(), direction.y(), 0.0)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    using Eigen::Vector3d;
    const Eigen::Map<const Vector3d> a(parameters[0]), b(parameters[1]), a_later(parameters[2]),
        b_later(parameters[3]);
    residuals[0] = along_.dot((a - b) + (a_later - b_later));
    if (jacobians == nullptr) return true;
    for (int k = 0; k < 4; ++k) {
      if (jacobians[k] != nullptr) {
        Eigen::Map<Vector3d>{jacobians[k]} = k % 2 == 0 ? along_ : Vector3d(-along_);
      }
    }
    return true;
  }

 private:
  Eigen::Vector3d along_;
};

}  // namespace holdfast
