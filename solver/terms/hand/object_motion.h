// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <utility>
#include <vector>

#include <ceres/cost_function.h>
#include <ceres/sized_cost_function.h>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/hand_model.h"
#include "geometry/rotation.h"
#include "solver/unknowns/rotation_manifold.h"

namespace holdfast {

/// Reference frame of the object's motion, per frame: the world, or the wrist that holds the
/// object. world_from_carrier.
using Carrier = Eigen::Isometry3d;

/// Object rotation between two frames relative to the carrier, log(R_a^T F_a F_b^T R_b), radians,
/// and its derivatives by right increments of R_a and R_b.
struct CarriedTurn {
  CarriedTurn(const double* q_a, const double* q_b, const Carrier& a, const Carrier& b)
      : turn(LogSO3(Eigen::Map<const Eigen::Quaterniond>(q_a).toRotationMatrix().transpose() *
                    a.linear() * b.linear().transpose() *
                    Eigen::Map<const Eigen::Quaterniond>(q_b).toRotationMatrix())),
        d_a(-InverseLeftJacobianSO3(turn)),
        d_b(-d_a.transpose()) {}
  Eigen::Vector3d turn;
  Eigen::Matrix3d d_a, d_b;
};

/// Penalizes the change of the object pose between two frames a and b, both unknown:
///
///   E = |T'_b - T'_a|^2 + l^2 |log(R'_a^T R'_b)|^2
///
/// with the pose relative to the carrier, R' = F^T R and T' = F^-1 T. 6 residuals. Parameter
/// blocks: q_a (4, x y z w, with RotationManifold), T_a (3, meters, world), q_b, T_b. With the
/// world as carrier and l = 1, this is the object's part of the paper's E_t. `weight` on the sum.
class ObjectVelocity final : public ceres::SizedCostFunction<6, 4, 3, 4, 3> {
 public:
  ObjectVelocity(const Carrier& a, const Carrier& b, double lever_m, double weight)
      : a_(a), b_(b), lever_(lever_m), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    using Eigen::Vector3d;
    const CarriedTurn turn(parameters[0], parameters[2], a_, b_);
    const Eigen::Map<const Vector3d> T_a(parameters[1]), T_b(parameters[3]);
    Eigen::Map<Eigen::Matrix<double, 6, 1>> r(residuals);
    r.head<3>() = scale_ * (b_.linear().transpose() * (T_b - b_.translation()) -
                            a_.linear().transpose() * (T_a - a_.translation()));
    r.tail<3>() = scale_ * lever_ * turn.turn;
    if (jacobians == nullptr) return true;
    const auto fill = [&](int block, const Eigen::Matrix3d& d_turn, const Eigen::Matrix3d& d_T) {
      FillPoseJacobians(parameters, jacobians, block, scale_, scale_ * lever_, d_turn, d_T);
    };
    fill(0, turn.d_a, -a_.linear().transpose());
    fill(2, turn.d_b, b_.linear().transpose());
    return true;
  }

 private:
  Carrier a_, b_;
  double lever_, scale_;
};

/// Penalizes the change of the object's velocity over three frames a, b, c:
///
///   E = |T'_c - 2 T'_b + T'_a|^2 + l^2 |log(R'_b^T R'_c) - log(R'_a^T R'_b)|^2
///
/// with R' and T' as in ObjectVelocity; second differences per frame. 6 residuals. Parameter
/// blocks: q_a, T_a, q_b, T_b, q_c, T_c. `weight` on the sum; not part of the paper's energy.
class ObjectAcceleration final : public ceres::SizedCostFunction<6, 4, 3, 4, 3, 4, 3> {
 public:
  ObjectAcceleration(const Carrier& a, const Carrier& b, const Carrier& c, double lever_m,
                     double weight)
      : a_(a), b_(b), c_(c), lever_(lever_m), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const CarriedTurn before(parameters[0], parameters[2], a_, b_);
    const CarriedTurn after(parameters[2], parameters[4], b_, c_);
    const auto seen = [&](const Carrier& carrier, int block) -> Eigen::Vector3d {
      return carrier.linear().transpose() *
             (Eigen::Map<const Eigen::Vector3d>(parameters[block]) - carrier.translation());
    };
    Eigen::Map<Eigen::Matrix<double, 6, 1>> r(residuals);
    r.head<3>() = scale_ * (seen(c_, 5) - 2.0 * seen(b_, 3) + seen(a_, 1));
    r.tail<3>() = scale_ * lever_ * (after.turn - before.turn);
    if (jacobians == nullptr) return true;
    const auto fill = [&](int block, const Eigen::Matrix3d& d_turn, const Eigen::Matrix3d& d_T) {
      FillPoseJacobians(parameters, jacobians, block, scale_, scale_ * lever_, d_turn, d_T);
    };
    fill(0, -before.d_a, a_.linear().transpose());
    fill(2, after.d_a - before.d_b, -2.0 * b_.linear().transpose());
    fill(4, after.d_b, c_.linear().transpose());
    return true;
  }

 private:
  Carrier a_, b_, c_;
  double lever_, scale_;
};

/// Differences of finger poses over frames, E = |sum_k c_k P_k|^2: {-1, 1} is the fingers' part of
/// the paper's E_t with both frames unknown, {1, -2, 1} that of acceleration. 45 residuals, radians
/// times `lever`. Parameter blocks: one P (45) per coefficient. `weight` on the sum.
class FingerDifference final : public ceres::CostFunction {
 public:
  FingerDifference(std::vector<double> coefficients, double lever, double weight)
      : coefficients_(std::move(coefficients)), scale_(lever * std::sqrt(weight)) {
    set_num_residuals(kHandDofs);
    mutable_parameter_block_sizes()->assign(coefficients_.size(), kHandDofs);
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    Eigen::Map<FingerPose> r(residuals);
    r.setZero();
    for (std::size_t k = 0; k < coefficients_.size(); ++k) {
      r += scale_ * coefficients_[k] * Eigen::Map<const FingerPose>(parameters[k]);
      if (jacobians == nullptr || jacobians[k] == nullptr) continue;
      Eigen::Map<Eigen::Matrix<double, kHandDofs, kHandDofs, Eigen::RowMajor>> J(jacobians[k]);
      J.setZero();
      J.diagonal().setConstant(scale_ * coefficients_[k]);
    }
    return true;
  }

 private:
  std::vector<double> coefficients_;
  double scale_;
};

/// Keeps an object on a table or the ground from sinking into it. Over its vertices o_j,
///
///   E = sum_j max(0, height - (R o_j + T).z)^2,   m^2
///
/// One residual per vertex, meters. Parameter blocks: orientation q (4, x y z w, with
/// RotationManifold), translation T (3, meters, world). `weight` (1/m^2) on the sum. The resting
/// pose itself is imposed by ObjectData.
class Support final : public ceres::CostFunction {
 public:
  /// `vertices` (3 x n): object frame; `height_m`: of the support, world z. `vertices` must outlive
  /// the term.
  Support(const Eigen::Matrix3Xd& vertices, double height_m, double weight)
      : vertices_(vertices), height_(height_m), scale_(std::sqrt(weight)) {
    set_num_residuals(static_cast<int>(vertices.cols()));
    *mutable_parameter_block_sizes() = {4, 3};
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Vector3d up =
        Eigen::Map<const Eigen::Quaterniond>(parameters[0]).toRotationMatrix().row(2);
    for (Eigen::Index j = 0; j < vertices_.cols(); ++j) {
      const Eigen::Vector3d o = vertices_.col(j);
      const double depth = height_ - (up.dot(o) + parameters[1][2]);
      const bool below = depth > 0.0;
      residuals[j] = below ? scale_ * depth : 0.0;
      if (jacobians == nullptr) continue;
      if (jacobians[0] != nullptr) {
        // R exp(delta) o rises by up . (delta x o) = delta . (o x up).
        Eigen::Map<Eigen::RowVector4d> row(jacobians[0] + 4 * j);
        row.setZero();
        if (below) {
          row = RotationManifold::Lift(-scale_ * o.cross(up).transpose(), parameters[0]);
        }
      }
      if (jacobians[1] != nullptr) {
        Eigen::Map<Eigen::RowVector3d>(jacobians[1] + 3 * j) << 0.0, 0.0, below ? -scale_ : 0.0;
      }
    }
    return true;
  }

 private:
  const Eigen::Matrix3Xd& vertices_;
  double height_, scale_;
};

}  // namespace holdfast
