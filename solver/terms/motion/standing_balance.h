// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <ceres/cost_function.h>

#include <Eigen/Core>

namespace holdfast {

/// A person who stands does not tip over: the middle of the body's mass is over the feet.
///
///   r = sqrt(w) max(0, |S (c - m)| - allowed),   S = diag(1, 1, 0),   one residual, metres
///
/// c = sum_k mu_k q_k over kMasses (shares of an adult's mass, de Leva 1996, gathered at joints), m
/// the mean of kFeet. Parameter blocks: positions of the joints of kMasses, then of kFeet, in one
/// frame (3 each, world, metres). For frames in which the pelvis hardly moves: who walks falls from
/// step to step.
class StandingBalance final : public ceres::CostFunction {
 public:
  static constexpr std::array<std::pair<int, double>, 9> kMasses = {{{0, 0.14},  // pelvis
                                                                     {4, 0.15},  // knees
                                                                     {5, 0.15},
                                                                     {6, 0.14},  // trunk
                                                                     {9, 0.21},
                                                                     {15, 0.09},   // head
                                                                     {18, 0.055},  // elbows
                                                                     {19, 0.055},
                                                                     {16, 0.01}}};
  static constexpr std::array<int, 4> kFeet = {7, 8, 10, 11};

  StandingBalance(double allowed_m, double weight)
      : allowed_(allowed_m), scale_(std::sqrt(weight)) {
    set_num_residuals(1);
    mutable_parameter_block_sizes()->assign(kMasses.size() + kFeet.size(), 3);
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    Eigen::Vector2d off = Eigen::Vector2d::Zero();
    const auto share = [](std::size_t k) {
      return k < kMasses.size() ? kMasses[k].second : -1.0 / kFeet.size();
    };
    for (std::size_t k = 0; k < kMasses.size() + kFeet.size(); ++k) {
      off += share(k) * Eigen::Map<const Eigen::Vector2d>(parameters[k]);
    }
    const double length = off.norm(), beyond = length - allowed_;
    residuals[0] = scale_ * std::max(0.0, beyond);
    if (jacobians == nullptr) return true;
    Eigen::Vector3d slope = Eigen::Vector3d::Zero();
    if (beyond > 0.0) slope.head<2>() = scale_ / length * off;
    for (std::size_t k = 0; k < kMasses.size() + kFeet.size(); ++k) {
      if (jacobians[k] != nullptr) Eigen::Map<Eigen::Vector3d>{jacobians[k]} = share(k) * slope;
    }
    return true;
  }

 private:
  double allowed_, scale_;
};

}  // namespace holdfast
