// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>

namespace holdfast {

/// Nobody is asked to run.
///
///   r = sqrt(w) max(0, |S (q' - q)| / dt - fastest),   S = diag(1, 1, 0),   one residual, m/s
///
/// Parameter blocks: pelvis in one frame and a later one (3 each, world, metres); dt between them,
/// seconds. Steps make the pelvis' speed waver: a third of a second apart is a fair measure.
class PelvisSpeed final : public ceres::SizedCostFunction<1, 3, 3> {
 public:
  PelvisSpeed(double fastest_m_s, double dt_s, double weight)
      : fastest_(fastest_m_s), dt_(dt_s), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Vector2d way(parameters[1][0] - parameters[0][0],
                              parameters[1][1] - parameters[0][1]);
    const double length = way.norm(), beyond = length / dt_ - fastest_;
    residuals[0] = scale_ * std::max(0.0, beyond);
    if (jacobians == nullptr) return true;
    Eigen::Vector3d slope = Eigen::Vector3d::Zero();
    if (beyond > 0.0) slope.head<2>() = scale_ / (dt_ * length) * way;
    if (jacobians[0] != nullptr) Eigen::Map<Eigen::Vector3d>{jacobians[0]} = -slope;
    if (jacobians[1] != nullptr) Eigen::Map<Eigen::Vector3d>{jacobians[1]} = slope;
    return true;
  }

 private:
  double fastest_, dt_, scale_;
};

}  // namespace holdfast
