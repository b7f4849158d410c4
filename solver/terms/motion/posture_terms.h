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
#include "solver/terms/motion/goal_terms.h"

namespace holdfast {

/// Joints with fractions of an adult's mass (de Leva 1996), and those of the feet.
inline constexpr std::array<std::pair<int, double>, 9> kBalanceMasses = {{{0, 0.14},  // pelvis
                                                                          {4, 0.15},  // knees
                                                                          {5, 0.15},
                                                                          {6, 0.14},  // trunk
                                                                          {9, 0.21},
                                                                          {15, 0.09},   // head
                                                                          {18, 0.055},  // elbows
                                                                          {19, 0.055},
                                                                          {16, 0.01}}};
inline constexpr std::array<int, 4> kBalanceFeet = {7, 8, 10, 11};

/// Static balance: the center of mass of a standing body stays above the feet.
///
///   r = sqrt(w) max(0, |S (c - m)| - allowed),   S = diag(1, 1, 0),   one residual, meters
///
/// c = sum_k mu_k q_k over kBalanceMasses, m: mean of kBalanceFeet. Parameter blocks: positions of
/// the joints of kBalanceMasses, then of kBalanceFeet, in one frame (3 each, world, meters). For
/// frames in which the pelvis hardly moves: walking is not statically balanced.
inline MotionTerm StandingBalance(double allowed_m, double weight) {
  const auto evaluate = [allowed = allowed_m, scale = std::sqrt(weight)](
                            auto parameters, auto residuals, auto jacobians) {
    Eigen::Vector2d off = Eigen::Vector2d::Zero();
    const auto share = [](std::size_t k) {
      return k < kBalanceMasses.size() ? kBalanceMasses[k].second : -1.0 / kBalanceFeet.size();
    };
    for (std::size_t k = 0; k < kBalanceMasses.size() + kBalanceFeet.size(); ++k) {
      off += share(k) * Eigen::Map<const Eigen::Vector2d>(parameters[k]);
    }
    Eigen::Vector3d slope;
    residuals[0] = HorizontalExcess(off, 1.0, allowed, scale, slope);
    for (std::size_t k = 0; jacobians != nullptr && k < kBalanceMasses.size() + kBalanceFeet.size();
         ++k) {
      if (jacobians[k] != nullptr) Eigen::Map<Eigen::Vector3d>{jacobians[k]} = share(k) * slope;
    }
    return true;
  };
  return MakeTerm(1, std::vector<int>(kBalanceMasses.size() + kBalanceFeet.size(), 3), evaluate);
}

/// Joint limit taken from captured bodies.
///
///   r = sqrt(w) max(0, angle(R) - limit),   cos(angle) = (tr R - 1) / 2,   one residual, radians
///
/// Parameter block: the joint's rotation R relative to its parent (9, row-major).
inline MotionTerm RotationRange(double limit_rad, double weight) {
  return MakeTerm<1, 9>([limit = limit_rad, scale = std::sqrt(weight)](
                            auto parameters, auto residuals, auto jacobians) {
    const double* const R = parameters[0];
    const double cosine = std::clamp(0.5 * (R[0] + R[4] + R[8] - 1.0), -1.0, 1.0);
    const double beyond = std::acos(cosine) - limit;
    residuals[0] = scale * std::max(0.0, beyond);
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    std::fill_n(jacobians[0], 9, 0.0);
    if (beyond > 0.0) {
      const double sine = std::max(std::sqrt(1.0 - cosine * cosine), 1e-3);
      for (const int k : {0, 4, 8}) jacobians[0][k] = -0.5 * scale / sine;
    }
    return true;
  });
}

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
inline MotionTerm Obstacle(const DistanceGrid& solid, double clearance_m, double weight) {
  return MakeTerm<1, 3>([&solid, clearance = clearance_m, scale = std::sqrt(weight)](
                            auto parameters, auto residuals, auto jacobians) {
    Eigen::Vector3d slope;
    const double within =
        clearance - solid.Distance(Eigen::Map<const Eigen::Vector3d>(parameters[0]), &slope);
    residuals[0] = scale * std::max(0.0, within);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Vector3d>{jacobians[0]} = (within > 0.0 ? -scale : 0.0) * slope;
    }
    return true;
  });
}

/// Step-period prior: one step later, the feet have swapped places.
///
///   r = sqrt(w) d . ((a - b) + (a' - b')),   one residual, meters
///
/// Parameter blocks: ankles a and b in one frame, and a' and b' one step later (3 each, world,
/// meters); d: unit direction of the path. Shorter, quicker steps at the same speed are out of
/// phase there.
inline MotionTerm Cadence(const Eigen::Vector2d& direction, double weight) {
  return MakeTerm<1, 3, 3, 3, 3>(
      [along =
           Eigen::Vector3d(std::sqrt(weight) * Eigen::Vector3d(direction.x(), direction.y(), 0.0))](
          auto parameters, auto residuals, auto jacobians) {
        using Eigen::Vector3d;
        const Eigen::Map<const Vector3d> a(parameters[0]), b(parameters[1]), a_later(parameters[2]),
            b_later(parameters[3]);
        residuals[0] = along.dot((a - b) + (a_later - b_later));
        if (jacobians == nullptr) return true;
        for (int k = 0; k < 4; ++k) {
          if (jacobians[k] != nullptr) {
            Eigen::Map<Vector3d>{jacobians[k]} = k % 2 == 0 ? along : Vector3d(-along);
          }
        }
        return true;
      });
}

/// Keeps the pelvis near its position in a walk at constant speed.
///
///   r = sqrt(w) S (q - reference),   2 residuals, meters
///
/// Parameter block: the pelvis (3, world, meters). Distributes progress over time, so that the
/// motion does not stand first and rush later.
inline MotionTerm PelvisPath(const Eigen::Vector2d& reference, double weight) {
  return MakeTerm<2, 3>(
      [reference, scale = std::sqrt(weight)](auto parameters, auto residuals, auto jacobians) {
        for (const int k : {0, 1}) residuals[k] = scale * (parameters[0][k] - reference[k]);
        if (jacobians != nullptr && jacobians[0] != nullptr) {
          Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>>{jacobians[0]} << scale, 0.0, 0.0,
              0.0, scale, 0.0;
        }
        return true;
      });
}

/// Limits the horizontal way from one point to another: the speed of the pelvis, or how far the
/// neck of a walking body is from above the pelvis (dt = 1).
///
///   r = sqrt(w) max(0, |S (q' - q)| / dt - most),   S = diag(1, 1, 0),   one residual, m/s or m
///
/// Parameter blocks: q and q' (3 each, world, meters): the pelvis in one frame and, dt seconds
/// later, in another; or pelvis and neck. Steps make the pelvis speed oscillate; an interval of
/// 1/3 s gives a fair estimate. The trunk is half a meter long, so 5 cm are 6 degrees.
inline MotionTerm HorizontalLimit(double most, double dt_s, double weight) {
  return MakeTerm<1, 3, 3>([most, dt = dt_s, scale = std::sqrt(weight)](
                               auto parameters, auto residuals, auto jacobians) {
    const Eigen::Vector2d way(parameters[1][0] - parameters[0][0],
                              parameters[1][1] - parameters[0][1]);
    Eigen::Vector3d slope;
    residuals[0] = HorizontalExcess(way, dt, most, scale, slope);
    if (jacobians == nullptr) return true;
    if (jacobians[0] != nullptr) Eigen::Map<Eigen::Vector3d>{jacobians[0]} = -slope;
    if (jacobians[1] != nullptr) Eigen::Map<Eigen::Vector3d>{jacobians[1]} = slope;
    return true;
  });
}

}  // namespace holdfast
