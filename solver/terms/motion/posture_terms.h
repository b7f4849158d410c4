// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <ceres/cost_function.h>
#include <ceres/sized_cost_function.h>
#include <Eigen/Core>

#include "geometry/mesh/distance_grid.h"

namespace holdfast {

/// Static balance: the center of mass of a standing body stays above the feet.
///
///   r = sqrt(w) max(0, |S (c - m)| - allowed),   S = diag(1, 1, 0),   one residual, meters
///
/// c = sum_k mu_k q_k over kMasses (fractions of an adult's mass, de Leva 1996, assigned to
/// joints), m: mean of kFeet. Parameter blocks: positions of the joints of kMasses, then of kFeet,
/// in one frame (3 each, world, meters). For frames in which the pelvis hardly moves: walking is
/// not statically balanced.
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

/// Keeps the trunk upright while walking.
///
///   r = sqrt(w) max(0, |S (n - q)| - farthest),   S = diag(1, 1, 0),   one residual, meters
///
/// Parameter blocks: pelvis q and neck n (3 each, world, meters). The trunk is half a meter long,
/// so 5 cm are 6 degrees.
class UprightTrunk final : public ceres::SizedCostFunction<1, 3, 3> {
 public:
  UprightTrunk(double farthest_m, double weight)
      : farthest_(farthest_m), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Vector2d off(parameters[1][0] - parameters[0][0],
                              parameters[1][1] - parameters[0][1]);
    const double length = off.norm(), beyond = length - farthest_;
    residuals[0] = scale_ * std::max(0.0, beyond);
    if (jacobians == nullptr) return true;
    Eigen::Vector3d slope = Eigen::Vector3d::Zero();
    if (beyond > 0.0) slope.head<2>() = scale_ / length * off;
    if (jacobians[0] != nullptr) Eigen::Map<Eigen::Vector3d>{jacobians[0]} = -slope;
    if (jacobians[1] != nullptr) Eigen::Map<Eigen::Vector3d>{jacobians[1]} = slope;
    return true;
  }

 private:
  double farthest_, scale_;
};

/// Joint limit taken from captured bodies.
///
///   r = sqrt(w) max(0, angle(R) - limit),   cos(angle) = (tr R - 1) / 2,   one residual, radians
///
/// Parameter block: the joint's rotation R relative to its parent (9, row-major).
class RotationRange final : public ceres::SizedCostFunction<1, 9> {
 public:
  RotationRange(double limit_rad, double weight) : limit_(limit_rad), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const double* const R = parameters[0];
    const double cosine = std::clamp(0.5 * (R[0] + R[4] + R[8] - 1.0), -1.0, 1.0);
    const double beyond = std::acos(cosine) - limit_;
    residuals[0] = scale_ * std::max(0.0, beyond);
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    std::fill_n(jacobians[0], 9, 0.0);
    if (beyond > 0.0) {
      const double sine = std::max(std::sqrt(1.0 - cosine * cosine), 1e-3);
      for (const int k : {0, 4, 8}) jacobians[0][k] = -0.5 * scale_ / sine;
    }
    return true;
  }

 private:
  double limit_, scale_;
};

/// Prior that keeps latents near their initial sample.
///
///   r = sqrt(lambda) (z - z_0),   n residuals
///
/// Parameter block: latents z (n), of one step or of all. With z_0 a sample of N(0, I), the result
/// stays at the typical radius of samples; with z_0 = 0 this is the paper's prior, which biases
/// motions towards the mean.
class LatentPrior final : public ceres::CostFunction {
 public:
  LatentPrior(Eigen::VectorXd center, double weight)
      : center_(std::move(center)), scale_(std::sqrt(weight)) {
    set_num_residuals(static_cast<int>(center_.size()));
    *mutable_parameter_block_sizes() = {num_residuals()};
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Index n = center_.size();
    Eigen::Map<Eigen::VectorXd>(residuals, n) =
        scale_ * (Eigen::Map<const Eigen::VectorXd>(parameters[0], n) - center_);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<Eigen::MatrixXd>(jacobians[0], n, n) = scale_ * Eigen::MatrixXd::Identity(n, n);
    }
    return true;
  }

 private:
  Eigen::VectorXd center_;
  double scale_;
};

/// Smoothness of a joint's motion.
///
///   r = sqrt(w) (q_0 - 2 q_1 + q_2) / dt^2,   3 residuals, m/s^2
///
/// Parameter blocks: the joint's positions in three successive frames (3 each, world, meters).
class JointAcceleration final : public ceres::SizedCostFunction<3, 3, 3, 3> {
 public:
  JointAcceleration(double dt_s, double weight) : scale_(std::sqrt(weight) / (dt_s * dt_s)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    for (int k = 0; k < 3; ++k) {
      residuals[k] = scale_ * (parameters[0][k] - 2.0 * parameters[1][k] + parameters[2][k]);
    }
    if (jacobians == nullptr) return true;
    for (int b = 0; b < 3; ++b) {
      if (jacobians[b] == nullptr) continue;
      Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>{jacobians[b]} =
          (b == 1 ? -2.0 : 1.0) * scale_ * Eigen::Matrix3d::Identity();
    }
    return true;
  }

 private:
  double scale_;
};

/// Keeps a joint outside a solid.
///
///   r = sqrt(w) max(0, clearance - phi(q)),   one residual, meters
///
/// phi: signed distance to the solid, positive outside. Parameter block: the joint's position q (3,
/// world, meters). `clearance_m`: thickness of the body around the joint. `solid` must outlive it.
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

/// Step-period prior: one step later, the feet have swapped places.
///
///   r = sqrt(w) d . ((a - b) + (a' - b')),   one residual, meters
///
/// Parameter blocks: ankles a and b in one frame, and a' and b' one step later (3 each, world,
/// meters); d: unit direction of the path. Shorter, quicker steps at the same speed are out of
/// phase there.
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

/// Keeps the pelvis near its position in a walk at constant speed.
///
///   r = sqrt(w) S (q - reference),   2 residuals, meters
///
/// Parameter block: the pelvis (3, world, meters). Distributes progress over time, so that the
/// motion does not stand first and rush later.
class PelvisPath final : public ceres::SizedCostFunction<2, 3> {
 public:
  PelvisPath(const Eigen::Vector2d& reference, double weight)
      : reference_(reference), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    for (const int k : {0, 1}) residuals[k] = scale_ * (parameters[0][k] - reference_[k]);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>>{jacobians[0]} << scale_, 0.0, 0.0,
          0.0, scale_, 0.0;
    }
    return true;
  }

 private:
  Eigen::Vector2d reference_;
  double scale_;
};

/// Limits the horizontal speed of the pelvis.
///
///   r = sqrt(w) max(0, |S (q' - q)| / dt - fastest),   S = diag(1, 1, 0),   one residual, m/s
///
/// Parameter blocks: pelvis in one frame and a later one (3 each, world, meters); dt: time between
/// them, seconds. Steps make the pelvis speed oscillate; an interval of 1/3 s gives a fair
/// estimate.
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
