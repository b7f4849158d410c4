// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <ceres/cost_function.h>
#include <ceres/sized_cost_function.h>
#include <Eigen/Core>

namespace holdfast {

/// Direction of the forearm, for the approach of the hand.
///
///   r = sqrt(w) ((q_wrist - q_elbow) / |q_wrist - q_elbow| - a),   3 residuals
///
/// Parameter blocks: positions of elbow and wrist (3 each, world, meters). a: unit vector.
class ApproachDirection final : public ceres::SizedCostFunction<3, 3, 3> {
 public:
  ApproachDirection(const Eigen::Vector3d& direction, double weight)
      : direction_(direction), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Vector3d way = Eigen::Map<const Eigen::Vector3d>(parameters[1]) -
                                Eigen::Map<const Eigen::Vector3d>(parameters[0]);
    const double length = std::max(way.norm(), 1e-9);
    const Eigen::Vector3d unit = way / length;
    Eigen::Map<Eigen::Vector3d>{residuals} = scale_ * (unit - direction_);
    if (jacobians == nullptr) return true;
    const Eigen::Matrix3d J_unit_way =
        scale_ / length * (Eigen::Matrix3d::Identity() - unit * unit.transpose());
    for (const int k : {0, 1}) {
      if (jacobians[k] == nullptr) continue;
      Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>{jacobians[k]} =
          k == 0 ? Eigen::Matrix3d(-J_unit_way) : J_unit_way;
    }
    return true;
  }

 private:
  Eigen::Vector3d direction_;
  double scale_;
};

/// A joint reaches a target at some time within a window: soft minimum of its distance over n
/// frames,
///
///   s^2 = -tau^2 log( sum_t exp(-|q_t - G|^2 / tau^2) / n ),   r = sqrt(w) s
///
/// One residual, meters; never less than the minimum distance, and close to it for small tau. The
/// gradient of s^2 / 2 is sum_t p_t (q_t - G) with p = softmax(-|q_t - G|^2 / tau^2): frames are
/// weighted by their proximity. Parameter blocks: the joint's positions q_t (n times 3, world,
/// meters). The time of arrival is free.
class FirstArrival final : public ceres::CostFunction {
 public:
  /// `tau_m`: tau as a distance, meters.
  FirstArrival(const Eigen::Vector3d& goal, int num_frames, double tau_m, double weight)
      : goal_(goal), tau_(tau_m), scale_(std::sqrt(weight)) {
    set_num_residuals(1);
    mutable_parameter_block_sizes()->assign(static_cast<std::size_t>(num_frames), 3);
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const std::size_t n = parameter_block_sizes().size();
    std::vector<double> share(n);
    double least = INFINITY;
    for (std::size_t t = 0; t < n; ++t) {
      share[t] = (Eigen::Map<const Eigen::Vector3d>(parameters[t]) - goal_).squaredNorm();
      least = std::min(least, share[t]);
    }
    double sum = 0.0;
    for (double& value : share) sum += value = std::exp((least - value) / (tau_ * tau_));
    const double squared = least - tau_ * tau_ * std::log(sum / static_cast<double>(n));
    const double s = std::sqrt(std::max(squared, 1e-18));
    residuals[0] = scale_ * s;
    if (jacobians == nullptr) return true;
    for (std::size_t t = 0; t < n; ++t) {
      if (jacobians[t] == nullptr) continue;
      Eigen::Map<Eigen::Vector3d>{jacobians[t]} =
          scale_ * share[t] / (sum * s) *
          (Eigen::Map<const Eigen::Vector3d>(parameters[t]) - goal_);
    }
    return true;
  }

 private:
  Eigen::Vector3d goal_;
  double tau_, scale_;
};

/// Target position of a joint.
///
///   r = sqrt(w) (q - G),   3 residuals, meters
///
/// Parameter block: the joint's position q (3, world, meters). `weight` w on the sum. This is the
/// goal of WANDR's VAE + opt at a given frame (Diomataris et al. 2024, sec. 4).
class JointGoal final : public ceres::SizedCostFunction<3, 3> {
 public:
  JointGoal(const Eigen::Vector3d& goal, double weight) : goal_(goal), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    Eigen::Map<Eigen::Vector3d>{residuals} =
        scale_ * (Eigen::Map<const Eigen::Vector3d>(parameters[0]) - goal_);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>{jacobians[0]} =
          scale_ * Eigen::Matrix3d::Identity();
    }
    return true;
  }

 private:
  Eigen::Vector3d goal_;
  double scale_;
};

/// Penalizes a horizontal pelvis-to-goal distance beyond arm's reach.
///
///   r = sqrt(w) max(0, |S (q - G)| - farthest),   S = diag(1, 1, 0),   one residual, meters
///
/// Parameter block: the pelvis (3, world, meters). Without this term, a body that stopped too early
/// bends to cover the remaining distance.
class StandNear final : public ceres::SizedCostFunction<1, 3> {
 public:
  StandNear(const Eigen::Vector3d& goal, double farthest_m, double weight)
      : goal_(goal.head<2>()), farthest_(farthest_m), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Vector2d way = Eigen::Map<const Eigen::Vector2d>(parameters[0]) - goal_;
    const double length = way.norm(), beyond = length - farthest_;
    residuals[0] = scale_ * std::max(0.0, beyond);
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    Eigen::Map<Eigen::Vector3d> slope(jacobians[0]);
    slope.setZero();
    if (beyond > 0.0) slope.head<2>() = scale_ / length * way;
    return true;
  }

 private:
  Eigen::Vector2d goal_;
  double farthest_, scale_;
};

/// Turns the face to a target.
///
///   r = sqrt(w) (A e_z - g),   g = (G - q) / |G - q|,   3 residuals, about radians
///
/// Parameter blocks: the head's rotation A to the world (9, row-major; SMPL-X faces look along z),
/// the head's position q (3, world, meters).
class LookAt final : public ceres::SizedCostFunction<3, 9, 3> {
 public:
  LookAt(const Eigen::Vector3d& goal, double weight) : goal_(goal), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Vector3d way = goal_ - Eigen::Map<const Eigen::Vector3d>(parameters[1]);
    const double distance = std::max(way.norm(), 1e-6);
    const Eigen::Vector3d wanted = way / distance;
    for (int k = 0; k < 3; ++k) residuals[k] = scale_ * (parameters[0][3 * k + 2] - wanted[k]);
    if (jacobians == nullptr) return true;
    if (jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 3, 9, Eigen::RowMajor>> J(jacobians[0]);
      J.setZero();
      for (int k = 0; k < 3; ++k) J(k, 3 * k + 2) = scale_;
    }
    if (jacobians[1] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>{jacobians[1]} =
          scale_ / distance * (Eigen::Matrix3d::Identity() - wanted * wanted.transpose());
    }
    return true;
  }

 private:
  Eigen::Vector3d goal_;
  double scale_;
};

/// Heading along the path while walking.
///
///   r = sqrt(w) atan2(h x d, h . d),   h = S A e_z,   S = diag(1, 1, 0),   one residual, radians
///
/// Parameter block: the pelvis' rotation to the world (9, row-major; SMPL-X faces along z); d is
/// the direction of the path. Returns false for a pelvis that faces straight up or down.
class HeadingAlong final : public ceres::SizedCostFunction<1, 9> {
 public:
  HeadingAlong(const Eigen::Vector2d& direction, double weight)
      : direction_(direction), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Vector2d facing(parameters[0][2], parameters[0][5]);
    if (facing.squaredNorm() < 1e-12) return false;
    residuals[0] = scale_ * std::atan2(facing.x() * direction_.y() - facing.y() * direction_.x(),
                                       facing.dot(direction_));
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    std::fill_n(jacobians[0], 9, 0.0);
    jacobians[0][2] = scale_ * facing.y() / facing.squaredNorm();
    jacobians[0][5] = -scale_ * facing.x() / facing.squaredNorm();
    return true;
  }

 private:
  Eigen::Vector2d direction_;
  double scale_;
};

/// Limits the turning rate of the pelvis.
///
///   r = sqrt(w) max(0, |a| / dt - fastest),   one residual, rad/s
///   a = atan2(h x h', h . h'),   h = S A e_z,   S = diag(1, 1, 0)
///
/// Parameter blocks: the pelvis' rotation to the world in one frame and a later one (9 each,
/// row-major; SMPL-X faces along z); dt: time between them, seconds. Returns false for a pelvis
/// that faces straight up or down.
class HeadingTurn final : public ceres::SizedCostFunction<1, 9, 9> {
 public:
  HeadingTurn(double fastest_rad_s, double dt_s, double weight)
      : fastest_(fastest_rad_s), dt_(dt_s), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Vector2d before(parameters[0][2], parameters[0][5]);
    const Eigen::Vector2d after(parameters[1][2], parameters[1][5]);
    if (before.squaredNorm() < 1e-12 || after.squaredNorm() < 1e-12) return false;
    const double angle =
        std::atan2(before.x() * after.y() - before.y() * after.x(), before.dot(after));
    const double beyond = std::abs(angle) / dt_ - fastest_;
    residuals[0] = scale_ * std::max(0.0, beyond);
    if (jacobians == nullptr) return true;
    const double slope = beyond > 0.0 ? std::copysign(scale_ / dt_, angle) : 0.0;
    const auto write = [](double* jacobian, const Eigen::Vector2d& facing, double by) {
      if (jacobian == nullptr) return;
      std::fill_n(jacobian, 9, 0.0);
      jacobian[2] = -by * facing.y() / facing.squaredNorm();
      jacobian[5] = by * facing.x() / facing.squaredNorm();
    };
    write(jacobians[0], before, -slope);
    write(jacobians[1], after, slope);
    return true;
  }

 private:
  double fastest_, dt_, scale_;
};

}  // namespace holdfast
