// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include <ceres/cost_function.h>
#include <Eigen/Core>

namespace holdfast {

/// A term of a motion that is given by its evaluation: as CostFunction::Evaluate.
template <typename Evaluation>
class EvaluatedTerm final : public ceres::CostFunction {
 public:
  EvaluatedTerm(int num_residuals, const std::vector<int>& block_sizes, Evaluation evaluation)
      : evaluation_(std::move(evaluation)) {
    set_num_residuals(num_residuals);
    *mutable_parameter_block_sizes() = block_sizes;
  }
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    return evaluation_(parameters, residuals, jacobians);
  }

 private:
  Evaluation evaluation_;
};

using MotionTerm = std::shared_ptr<const ceres::CostFunction>;

template <typename Evaluation>
MotionTerm MakeTerm(int num_residuals, const std::vector<int>& block_sizes, Evaluation evaluation) {
  return std::make_shared<EvaluatedTerm<Evaluation>>(num_residuals, block_sizes,
                                                     std::move(evaluation));
}
template <int kResiduals, int... kBlockSizes, typename Evaluation>
MotionTerm MakeTerm(Evaluation evaluation) {
  return MakeTerm(kResiduals, {kBlockSizes...}, std::move(evaluation));
}

/// `scale` max(0, |off| / dt - most) for a horizontal way `off`, and its derivative by the way's
/// end.
inline double HorizontalExcess(const Eigen::Vector2d& off, double dt, double most, double scale,
                               Eigen::Vector3d& slope) {
  const double length = off.norm(), beyond = length / dt - most;
  slope.setZero();
  if (beyond > 0.0) slope.head<2>() = scale / (dt * length) * off;
  return scale * std::max(0.0, beyond);
}

/// Direction of the forearm, for the approach of the hand.
///
///   r = sqrt(w) ((q_wrist - q_elbow) / |q_wrist - q_elbow| - a),   3 residuals
///
/// Parameter blocks: positions of elbow and wrist (3 each, world, meters). a: unit vector.
inline MotionTerm ApproachDirection(const Eigen::Vector3d& direction, double weight) {
  return MakeTerm<3, 3, 3>(
      [direction, scale = std::sqrt(weight)](auto parameters, auto residuals, auto jacobians) {
        const Eigen::Vector3d way = Eigen::Map<const Eigen::Vector3d>(parameters[1]) -
                                    Eigen::Map<const Eigen::Vector3d>(parameters[0]);
        const double length = std::max(way.norm(), 1e-9);
        const Eigen::Vector3d unit = way / length;
        Eigen::Map<Eigen::Vector3d>{residuals} = scale * (unit - direction);
        if (jacobians == nullptr) return true;
        const Eigen::Matrix3d J_unit_way =
            scale / length * (Eigen::Matrix3d::Identity() - unit * unit.transpose());
        for (const int k : {0, 1}) {
          if (jacobians[k] == nullptr) continue;
          Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>{jacobians[k]} =
              k == 0 ? Eigen::Matrix3d(-J_unit_way) : J_unit_way;
        }
        return true;
      });
}

/// A joint reaches a target at some time within a window: soft minimum of its distance over n
/// frames,
///
///   s^2 = -tau^2 log( sum_t exp(-|q_t - G|^2 / tau^2) / n ),   r = sqrt(w) s
///
/// One residual, meters; never less than the minimum distance, and close to it for small tau. The
/// gradient of s^2 / 2 is sum_t p_t (q_t - G) with p = softmax(-|q_t - G|^2 / tau^2): frames are
/// weighted by their proximity. Parameter blocks: the joint's positions q_t (n times 3, world,
/// meters). The time of arrival is free. `tau_m`: tau as a distance, meters.
inline MotionTerm FirstArrival(const Eigen::Vector3d& goal, int num_frames, double tau_m,
                               double weight) {
  const auto evaluate = [goal, n = static_cast<std::size_t>(num_frames), tau = tau_m,
                         scale = std::sqrt(weight)](auto parameters, auto residuals,
                                                    auto jacobians) {
    std::vector<double> share(n);
    double least = INFINITY;
    for (std::size_t t = 0; t < n; ++t) {
      share[t] = (Eigen::Map<const Eigen::Vector3d>(parameters[t]) - goal).squaredNorm();
      least = std::min(least, share[t]);
    }
    double sum = 0.0;
    for (double& value : share) sum += value = std::exp((least - value) / (tau * tau));
    const double squared = least - tau * tau * std::log(sum / static_cast<double>(n));
    const double s = std::sqrt(std::max(squared, 1e-18));
    residuals[0] = scale * s;
    if (jacobians == nullptr) return true;
    for (std::size_t t = 0; t < n; ++t) {
      if (jacobians[t] == nullptr) continue;
      Eigen::Map<Eigen::Vector3d>{jacobians[t]} =
          scale * share[t] / (sum * s) * (Eigen::Map<const Eigen::Vector3d>(parameters[t]) - goal);
    }
    return true;
  };
  return MakeTerm(1, std::vector<int>(static_cast<std::size_t>(num_frames), 3), evaluate);
}

/// Keeps a parameter block near a given point: a joint near its goal, latents near their sample.
///
///   r = sqrt(w) (x - x_0),   n residuals
///
/// Parameter block: x (n). `weight` w on the sum. For a joint (world, meters), this is the goal of
/// WANDR's VAE + opt at a given frame (Diomataris et al. 2024, sec. 4). For latents, with x_0 a
/// sample of N(0, I), the result stays at the typical radius of samples; with x_0 = 0 this is the
/// paper's prior, which biases motions towards the mean.
///
/// kLength has the same energy and gradient in one residual, r = sqrt(w |x - x_0|^2 + 1e-18), so
/// that its Jacobian has n numbers instead of n^2: for minimizers that use the gradient alone.
class NearPoint final : public ceres::CostFunction {
 public:
  enum class Residuals { kCoordinates, kLength };
  NearPoint(Eigen::VectorXd point, double weight, Residuals residuals = Residuals::kCoordinates)
      : point_(std::move(point)), scale_(std::sqrt(weight)) {
    const auto size = static_cast<int>(point_.size());
    set_num_residuals(residuals == Residuals::kLength ? 1 : size);
    *mutable_parameter_block_sizes() = {size};
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Index n = point_.size(), rows = num_residuals();
    const Eigen::VectorXd way =
        scale_ * (Eigen::Map<const Eigen::VectorXd>(parameters[0], n) - point_);
    const double length = std::sqrt(way.squaredNorm() + 1e-18);
    if (rows < n) {
      residuals[0] = length;
    } else {
      Eigen::Map<Eigen::VectorXd>(residuals, n) = way;
    }
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    if (rows < n) {
      Eigen::Map<Eigen::VectorXd>(jacobians[0], n) = scale_ / length * way;
    } else {
      Eigen::Map<Eigen::MatrixXd>(jacobians[0], n, n) = scale_ * Eigen::MatrixXd::Identity(n, n);
    }
    return true;
  }

 private:
  Eigen::VectorXd point_;
  double scale_;
};

/// Penalizes a horizontal pelvis-to-goal distance beyond arm's reach.
///
///   r = sqrt(w) max(0, |S (q - G)| - farthest),   S = diag(1, 1, 0),   one residual, meters
///
/// Parameter block: the pelvis (3, world, meters). Without this term, a body that stopped too early
/// bends to cover the remaining distance.
inline MotionTerm StandNear(const Eigen::Vector3d& goal, double farthest_m, double weight) {
  return MakeTerm<1, 3>(
      [stand = Eigen::Vector2d(goal.head<2>()), farthest = farthest_m, scale = std::sqrt(weight)](
          auto parameters, auto residuals, auto jacobians) {
        const Eigen::Vector2d way = Eigen::Map<const Eigen::Vector2d>(parameters[0]) - stand;
        Eigen::Vector3d slope;
        residuals[0] = HorizontalExcess(way, 1.0, farthest, scale, slope);
        if (jacobians != nullptr && jacobians[0] != nullptr) {
          Eigen::Map<Eigen::Vector3d>{jacobians[0]} = slope;
        }
        return true;
      });
}

/// Turns the face to a target.
///
///   r = sqrt(w) (A e_z - g),   g = (G - q) / |G - q|,   3 residuals, about radians
///
/// Parameter blocks: the head's rotation A to the world (9, row-major; SMPL-X faces look along z),
/// the head's position q (3, world, meters).
inline MotionTerm LookAt(const Eigen::Vector3d& goal, double weight) {
  return MakeTerm<3, 9, 3>(
      [goal, scale = std::sqrt(weight)](auto parameters, auto residuals, auto jacobians) {
        const Eigen::Vector3d way = goal - Eigen::Map<const Eigen::Vector3d>(parameters[1]);
        const double distance = std::max(way.norm(), 1e-6);
        const Eigen::Vector3d wanted = way / distance;
        for (int k = 0; k < 3; ++k) residuals[k] = scale * (parameters[0][3 * k + 2] - wanted[k]);
        if (jacobians == nullptr) return true;
        if (jacobians[0] != nullptr) {
          Eigen::Map<Eigen::Matrix<double, 3, 9, Eigen::RowMajor>> J(jacobians[0]);
          J.setZero();
          for (int k = 0; k < 3; ++k) J(k, 3 * k + 2) = scale;
        }
        if (jacobians[1] != nullptr) {
          Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>{jacobians[1]} =
              scale / distance * (Eigen::Matrix3d::Identity() - wanted * wanted.transpose());
        }
        return true;
      });
}

/// Writes `scale` times the derivative of the angle of `facing` = S A e_z by A (9, row-major); does
/// nothing without a `jacobian`.
inline void WriteHeadingJacobian(const Eigen::Vector2d& facing, double scale, double* jacobian) {
  if (jacobian == nullptr) return;
  std::fill_n(jacobian, 9, 0.0);
  jacobian[2] = -scale * facing.y() / facing.squaredNorm();
  jacobian[5] = scale * facing.x() / facing.squaredNorm();
}

/// Heading along the path while walking.
///
///   r = sqrt(w) atan2(h x d, h . d),   h = S A e_z,   S = diag(1, 1, 0),   one residual, radians
///
/// Parameter block: the pelvis' rotation to the world (9, row-major; SMPL-X faces along z); d is
/// the direction of the path. Returns false for a pelvis that faces straight up or down.
inline MotionTerm HeadingAlong(const Eigen::Vector2d& direction, double weight) {
  return MakeTerm<1, 9>(
      [direction, scale = std::sqrt(weight)](auto parameters, auto residuals, auto jacobians) {
        const Eigen::Vector2d facing(parameters[0][2], parameters[0][5]);
        if (facing.squaredNorm() < 1e-12) return false;
        residuals[0] = scale * std::atan2(facing.x() * direction.y() - facing.y() * direction.x(),
                                          facing.dot(direction));
        if (jacobians != nullptr) WriteHeadingJacobian(facing, -scale, jacobians[0]);
        return true;
      });
}

/// Limits the turning rate of the pelvis.
///
///   r = sqrt(w) max(0, |a| / dt - fastest),   one residual, rad/s
///   a = atan2(h x h', h . h'),   h = S A e_z,   S = diag(1, 1, 0)
///
/// Parameter blocks: the pelvis' rotation to the world in one frame and a later one (9 each,
/// row-major; SMPL-X faces along z); dt: time between them, seconds. Returns false for a pelvis
/// that faces straight up or down.
inline MotionTerm HeadingTurn(double fastest_rad_s, double dt_s, double weight) {
  return MakeTerm<1, 9, 9>([fastest = fastest_rad_s, dt = dt_s, scale = std::sqrt(weight)](
                               auto parameters, auto residuals, auto jacobians) {
    const Eigen::Vector2d before(parameters[0][2], parameters[0][5]);
    const Eigen::Vector2d after(parameters[1][2], parameters[1][5]);
    if (before.squaredNorm() < 1e-12 || after.squaredNorm() < 1e-12) return false;
    const double angle =
        std::atan2(before.x() * after.y() - before.y() * after.x(), before.dot(after));
    const double beyond = std::abs(angle) / dt - fastest;
    residuals[0] = scale * std::max(0.0, beyond);
    if (jacobians == nullptr) return true;
    const double slope = beyond > 0.0 ? std::copysign(scale / dt, angle) : 0.0;
    WriteHeadingJacobian(before, -slope, jacobians[0]);
    WriteHeadingJacobian(after, slope, jacobians[1]);
    return true;
  });
}

}  // namespace holdfast
