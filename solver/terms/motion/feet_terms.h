// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <ceres/cost_function.h>
#include <ceres/sized_cost_function.h>
#include <Eigen/Core>

namespace holdfast {

/// Penalizes both feet leaving the floor: the lowest foot joint must stay low.
///
///   r = sqrt(w) max(0, min_k (q_k,z - rest_k) - allowed),   one residual, meters
///
/// Parameter blocks: positions q_k of the foot joints of one frame (3 each, world, meters);
/// `resting`: their heights with the soles on the floor.
class Airborne final : public ceres::CostFunction {
 public:
  Airborne(std::vector<double> resting_m, double allowed_m, double weight)
      : resting_(std::move(resting_m)), allowed_(allowed_m), scale_(std::sqrt(weight)) {
    set_num_residuals(1);
    mutable_parameter_block_sizes()->assign(resting_.size(), 3);
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    std::size_t lowest = 0;
    double height = INFINITY;
    for (std::size_t k = 0; k < resting_.size(); ++k) {
      const double above = parameters[k][2] - resting_[k];
      if (above < height) {
        height = above;
        lowest = k;
      }
    }
    const double beyond = height - allowed_;
    residuals[0] = scale_ * std::max(0.0, beyond);
    if (jacobians == nullptr) return true;
    for (std::size_t k = 0; k < resting_.size(); ++k) {
      if (jacobians[k] == nullptr) continue;
      std::fill_n(jacobians[k], 3, 0.0);
      if (k == lowest && beyond > 0.0) jacobians[k][2] = scale_;
    }
    return true;
  }

 private:
  std::vector<double> resting_;
  double allowed_, scale_;
};

/// Keeps a joint from sinking below its height with the foot on the floor.
///
///   r = sqrt(w) max(0, lowest - q_z),   one residual, meters
///
/// Parameter block: the joint's position q (3, world, meters, floor z = 0).
class FloorContact final : public ceres::SizedCostFunction<1, 3> {
 public:
  FloorContact(double lowest_m, double weight) : lowest_(lowest_m), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const double depth = lowest_ - parameters[0][2];
    residuals[0] = scale_ * std::max(0.0, depth);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      jacobians[0][0] = jacobians[0][1] = 0.0;
      jacobians[0][2] = depth > 0.0 ? -scale_ : 0.0;
    }
    return true;
  }

 private:
  double lowest_, scale_;
};

/// Foot skate: a foot on the floor must not slide.
///
///   r = sqrt(w) S (q' - q),   S = diag(1, 1),   2 residuals, meters per frame
///
/// Parameter blocks: positions of a foot joint in two successive frames (3 each, world, meters).
/// Contact-aware by the weight w c with c = PlantedShare(height of the joint above its height with
/// the sole on the floor), updated as the motion changes and constant in between. A robust loss
/// lets a foot swing past the floor.
class FootSkate final : public ceres::SizedCostFunction<2, 3, 3> {
 public:
  explicit FootSkate(double weight) : scale_(std::sqrt(weight)) {}

  /// 1 up to 2 cm, 0 from 6 cm, smooth in between.
  static double PlantedShare(double height_m) {
    constexpr double kPlanted = 0.02, kLifted = 0.06;
    const double u = (height_m - kPlanted) / (kLifted - kPlanted);
    if (u <= 0.0) return 1.0;
    return u >= 1.0 ? 0.0 : 1.0 - u * u * (3.0 - 2.0 * u);
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    for (const int k : {0, 1}) residuals[k] = scale_ * (parameters[1][k] - parameters[0][k]);
    if (jacobians == nullptr) return true;
    for (const int b : {0, 1}) {
      if (jacobians[b] == nullptr) continue;
      const double slope = b == 0 ? -scale_ : scale_;
      Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>>{jacobians[b]} << slope, 0.0, 0.0,
          0.0, slope, 0.0;
    }
    return true;
  }

 private:
  double scale_;
};

/// Minimum pelvis height, since people walk on nearly straight legs.
///
///   r = sqrt(w) max(0, lowest - q_z),   one residual, meters
///
/// Parameter block: the pelvis (3, world, meters, z up).
class WalkingHeight final : public ceres::SizedCostFunction<1, 3> {
 public:
  WalkingHeight(double lowest_m, double weight) : lowest_(lowest_m), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const double below = lowest_ - parameters[0][2];
    residuals[0] = scale_ * std::max(0.0, below);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      jacobians[0][0] = jacobians[0][1] = 0.0;
      jacobians[0][2] = below > 0.0 ? -scale_ : 0.0;
    }
    return true;
  }

 private:
  double lowest_, scale_;
};

}  // namespace holdfast
