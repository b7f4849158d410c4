// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>

#include "geometry/mesh/distance_grid.h"

namespace holdfast {

/// A joint keeps out of a solid.
///
///   r = sqrt(w) max(0, clearance - phi(q)),   one residual, metres
///
/// phi: signed distance to the solid, positive outside. Parameter block: the joint's position q (3,
/// world, metres). `clearance_m` is how thick the body is about the joint. `solid` must outlive it.
class Obstacle final : public ceres::SizedCostFunction<1, 3> {
 public:
  Obstacle(const DistanceGrid& solid, double clearance_m, double weight)
      : solid_(solid), clearance_(clearance_m), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    Eigen::Vector3d slope;
    const double within =
        clearance_ - solid_.Distance(Eigen::Map<const Eigen::Vector3d>(parameters[0]), &slope);
    residuals[0] = scale_ * std::max(0.0, within);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Vector3d>{jacobians[0]} = (within > 0.0 ? -scale_ : 0.0) * slope;
    }
    return true;
  }

 private:
  const DistanceGrid& solid_;
  double clearance_, scale_;
};

}  // namespace holdfast
