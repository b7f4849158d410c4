// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <utility>
#include <vector>

#include <ceres/cost_function.h>

#include "geometry/body/hand_model.h"
#include "geometry/rotation.h"
#include "solver/unknowns/rotation_manifold.h"

namespace holdfast::testing {

/// E_d and E_c as anyone would first write them for Ceres: every residual of every pair, with
/// analytic Jacobians through hand and object. The truth that the compressed forms are held
/// against, and the baseline of the benchmark. Parameter blocks as in HandObjectBlock.
class PlainPairs final : public ceres::CostFunction {
 public:
  enum class Kind {
    kDistance,  ///< |v_i - (R o_j + T)| - D_ij, all pairs
    kContact,   ///< R^T (v_i - T) - o_j, three numbers a pair with D_ij < tau
  };

  PlainPairs(Kind kind, HandState* state, const Eigen::Matrix3Xd& object,
             const Eigen::MatrixXd& reference, double tau_m, double weight)
      : kind_(kind),
        state_(state),
        object_(object),
        reference_(reference),
        scale_(std::sqrt(weight)) {
    for (Eigen::Index i = 0; i < reference.cols(); ++i) {
      for (Eigen::Index j = 0; j < reference.rows(); ++j) {
        if (kind == Kind::kDistance || reference(j, i) < tau_m) {
          pairs_.emplace_back(static_cast<int>(i), static_cast<int>(j));
        }
      }
    }
    set_num_residuals(static_cast<int>(pairs_.size()) * (kind == Kind::kDistance ? 1 : 3));
    *mutable_parameter_block_sizes() = {4, 3, kHandDofs};
    // Vertex -> (group, member), to look Jacobians up.
    place_.resize(static_cast<std::size_t>(state->Hand().NumVertices()));
    for (std::size_t g = 0; g < state->Hand().Groups().size(); ++g) {
      const auto& vertices = state->Hand().Groups()[g].vertices;
      for (std::size_t m = 0; m < vertices.size(); ++m) {
        place_[static_cast<std::size_t>(vertices[m])] = {static_cast<int>(g), static_cast<int>(m)};
      }
    }
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Matrix3d R =
        Eigen::Map<const Eigen::Quaterniond>(parameters[0]).toRotationMatrix();
    const Eigen::Map<const Eigen::Vector3d> T(parameters[1]);
    state_->Evaluate(Eigen::Map<const FingerPose>(parameters[2]), jacobians != nullptr);
    using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const int n = num_residuals();
    Eigen::Matrix<double, 3, 4> lift = Eigen::Matrix<double, 3, 4>::Zero();
    if (jacobians != nullptr) {
      lift = RotationManifold::Lift(Eigen::Matrix3d::Identity(), parameters[0]);
    }
    for (std::size_t k = 0; k < pairs_.size(); ++k) {
      const auto [i, j] = pairs_[k];
      const Eigen::Vector3d turned = R * object_.col(j);
      const Eigen::Vector3d difference = state_->Vertices().col(i) - turned - T;
      const double distance = difference.norm();
      const bool scalar = kind_ == Kind::kDistance;
      const auto row = static_cast<Eigen::Index>(scalar ? k : 3 * k);
      if (scalar) {
        residuals[k] = scale_ * (distance - reference_(j, i));
      } else {
        Eigen::Map<Eigen::Vector3d>(residuals + 3 * k) = scale_ * R.transpose() * difference;
      }
      if (jacobians == nullptr) continue;
      // d difference / d(delta, T, fingers); R exp(delta) o = R o - R [o]x delta.
      // In the object's frame (contact) the vertex turns instead of the object.
      const Eigen::Matrix3d J_delta =
          scalar ? Eigen::Matrix3d(R * Skew(Eigen::Vector3d(object_.col(j))))
                 : Eigen::Matrix3d(
                       R * Skew(Eigen::Vector3d(R.transpose() * (state_->Vertices().col(i) - T))));
      const Eigen::Vector3d direction =
          distance > 1e-10 ? Eigen::Vector3d(difference / distance) : Eigen::Vector3d(0, 0, 0);
      const auto [g, m] = place_[static_cast<std::size_t>(i)];
      const auto& joints = state_->Hand().Groups()[static_cast<std::size_t>(g)].joints;
      const auto J_vertex = state_->GroupJacobian(g).middleRows<3>(3 * m);
      const auto put = [&](int block, Eigen::Index column, const auto& J3) {
        if (jacobians[block] == nullptr) return;
        Eigen::Map<Rows> J(jacobians[block], n, parameter_block_sizes()[block]);
        if (scalar) {
          J.block(row, column, 1, J3.cols()) = scale_ * direction.transpose() * J3;
        } else {
          J.block(row, column, 3, J3.cols()) = scale_ * R.transpose() * J3;
        }
      };
      put(0, 0, (J_delta * lift).eval());
      put(1, 0, (-Eigen::Matrix3d::Identity()).eval());
      if (jacobians[2] != nullptr) {
        Eigen::Map<Rows>(jacobians[2], n, kHandDofs).middleRows(row, scalar ? 1 : 3).setZero();
      }
      for (std::size_t a = 0; a < joints.size(); ++a) {
        put(2, 3 * joints[a], J_vertex.middleCols<3>(3 * static_cast<Eigen::Index>(a)).eval());
      }
    }
    return true;
  }

 private:
  Kind kind_;
  HandState* state_;
  Eigen::Matrix3Xd object_;
  Eigen::MatrixXd reference_;
  double scale_;
  std::vector<std::pair<int, int>> pairs_;
  std::vector<std::pair<int, int>> place_;
};

}  // namespace holdfast::testing
