// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <variant>
#include <vector>

#include <ceres/sized_cost_function.h>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/hand_model.h"
#include "geometry/rotation.h"
#include "solver/kernels/pair_kernel.h"
#include "solver/terms/hand/hand_term.h"
#include "solver/unknowns/rotation_manifold.h"

namespace holdfast {

/// Keeps the object, or a frame F = (R_f, f) fixed to it, close to a given pose (R0, T0): that of a
/// recording or its resting pose.
///
///   E = |R f + T - T0|^2 + l^2 |log(R0^T R R_f)|^2,   m^2,   l = 0.1 m
///
/// 6 residuals, meters: a rotation counts as the displacement at l, about the size of a handheld
/// object; with l = 0 only the position counts. Parameter blocks: orientation q (4, x y z w, with
/// RotationManifold), translation T (3, meters). `weight` (1/m^2) on the sum; residuals are scaled
/// by its square root.
class ObjectData final : public ceres::SizedCostFunction<6, 4, 3> {
 public:
  static constexpr double kLever = 0.1;  // meters

  ObjectData(const ObjectPose& given, double weight, const ObjectPose& fixed = {},
             double lever_m = kLever)
      : given_(given), fixed_(fixed), scale_(std::sqrt(weight)), turn_scale_(lever_m * scale_) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Map<const Eigen::Quaterniond> q(parameters[0]);
    const Eigen::Matrix3d R = q.toRotationMatrix();
    const Eigen::Matrix3d R_f = fixed_.orientation.toRotationMatrix();
    const Eigen::Vector3d turn =
        LogSO3(given_.orientation.conjugate().toRotationMatrix() * R * R_f);
    Eigen::Map<Eigen::Matrix<double, 6, 1>> r(residuals);
    r.head<3>() = scale_ * (R * fixed_.translation +
                            Eigen::Map<const Eigen::Vector3d>(parameters[1]) - given_.translation);
    r.tail<3>() = turn_scale_ * turn;
    if (jacobians == nullptr) return true;
    FillPoseJacobians(parameters, jacobians, 0, scale_, turn_scale_,
                      InverseLeftJacobianSO3(turn).transpose() * R_f.transpose(),
                      Eigen::Matrix3d::Identity());
    if (jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 6, 4, Eigen::RowMajor>>{jacobians[0]}.topRows<3>() =
          scale_ * RotationManifold::Lift(-R * Skew(fixed_.translation), parameters[0]);
    }
    return true;
  }

 private:
  ObjectPose given_, fixed_;
  double scale_, turn_scale_;
};

/// Precision of the pair loop. Single precision changes the optimal energy by about 1e-8 (relative)
/// and is twice as fast; sums over vertices are double in both cases.
enum class PairPrecision { kSingle, kDouble };

/// E_d: keeps the distances between hand and object of the first frame (IMoS, Ghosh et al. 2023,
/// eq. 7, read as the squared Frobenius norm).
///
///   E_d = sum_ij ( |v_i(P) - (R o_j + T)| - D_ij )^2
///
/// N x M residuals, meters, for N vertices of one hand and M (300) of the object. In the object
/// frame the residuals of vertex i depend on z_i only, so they sum up exactly to a 3 x 3 Hessian, a
/// gradient and a cost: one streaming pass over the pairs, without approximation. Where a hand
/// vertex and an object vertex coincide, the direction is taken as zero. Weight: lambda_d, on the
/// sum.
class HandObjectDistance final : public VertexTerm {
 public:
  /// `object` is (3 x M), object frame; `reference` (M x N) holds D, column i for hand vertex i.
  HandObjectDistance(const Eigen::Matrix3Xd& object, const Eigen::MatrixXd& reference,
                     double weight, PairPrecision precision = PairPrecision::kSingle,
                     Isa isa = BestIsa());

  double Add(const Eigen::Matrix3Xd& z, std::span<VertexQuadratic> quadratics) const override;

  /// D (M x N) for hand vertices `z` (3 x N) and object vertices (3 x M), both in the object frame.
  static Eigen::MatrixXd Distances(const Eigen::Matrix3Xd& z, const Eigen::Matrix3Xd& object);

 private:
  template <typename Real>
  struct Pairs {
    PairTargets<Real> targets;
    std::vector<Real> reference;  // N rows of targets.Stride()
    Pairs(const Eigen::Matrix3Xd& object, const Eigen::MatrixXd& distances);
  };
  template <typename Real>
  double AddPairs(const Pairs<Real>& pairs, const Eigen::Matrix3Xd& z,
                  std::span<VertexQuadratic> quadratics) const;

  double weight_;
  Isa isa_;
  std::variant<Pairs<float>, Pairs<double>> pairs_;  // in the requested precision
};

/// E_c: keeps contacts of the first frame together (IMoS, Ghosh et al. 2023, eq. 8).
///
///   E_c = sum_ij S_ij |v_i(P) - (R o_j + T)|^2,   S_ij = 1 where D_ij < tau, else 0
///
/// Residuals z_i - o_j, meters, object frame, three per contact pair. In closed form, with n_i
/// pairs at vertex i and m_i the mean of their o_j: sum_j |z - o_j|^2 = n_i |z - m_i|^2 + const.
/// Hence there is neither a pair loop nor the singularity that scalar distances have at zero.
/// Weight: lambda_c, on the sum.
class Contact final : public VertexTerm {
 public:
  /// `object` (3 x M): object frame; `reference` (M x N): first-frame distances; tau: meters.
  Contact(const Eigen::Matrix3Xd& object, const Eigen::MatrixXd& reference, double tau_m,
          double weight)
      : weight_(weight) {
    for (Eigen::Index i = 0; i < reference.cols(); ++i) {
      Anchor anchor{i, 0, Eigen::Vector3d::Zero(), 0.0};
      for (Eigen::Index j = 0; j < reference.rows(); ++j) {
        if (reference(j, i) < tau_m) {
          ++anchor.pairs;
          anchor.mean += object.col(j);
        }
      }
      if (anchor.pairs == 0) continue;
      anchor.mean /= anchor.pairs;
      for (Eigen::Index j = 0; j < reference.rows(); ++j) {
        if (reference(j, i) < tau_m) anchor.spread += (object.col(j) - anchor.mean).squaredNorm();
      }
      anchors_.push_back(anchor);
      num_pairs_ += anchor.pairs;
    }
  }

  double Add(const Eigen::Matrix3Xd& z, std::span<VertexQuadratic> quadratics) const override {
    double energy = 0.0;
    for (const Anchor& anchor : anchors_) {
      const Eigen::Vector3d difference = z.col(anchor.vertex) - anchor.mean;
      const double squares = anchor.pairs * difference.squaredNorm() + anchor.spread;
      VertexQuadratic& quadratic = quadratics[static_cast<std::size_t>(anchor.vertex)];
      quadratic.hessian.diagonal().array() += weight_ * anchor.pairs;
      quadratic.gradient += weight_ * anchor.pairs * difference;
      quadratic.cost += 0.5 * weight_ * squares;
      energy += squares;
    }
    return energy;
  }

  int NumPairs() const { return num_pairs_; }                  ///< sum of S
  std::size_t NumVertices() const { return anchors_.size(); }  ///< hand vertices with a pair

 private:
  struct Anchor {
    Eigen::Index vertex;
    int pairs;             // n_i
    Eigen::Vector3d mean;  // m_i
    double spread;         // sum_j |o_j - m_i|^2
  };

  double weight_;
  int num_pairs_ = 0;
  std::vector<Anchor> anchors_;
};

/// E_t: penalizes the change from the previous frame (IMoS, Ghosh et al. 2023, eq. 9, where it is
/// E_r; read as a sum of squared norms, the rotation's on SO(3)).
///
///   E_t = |log(R_prev^T R)|^2 + |T - T_prev|^2 + |P - P_prev|^2
///
/// 51 residuals: log of the rotation since the previous frame (radians, object frame), translation
/// (meters, world), finger axis-angles (radians). Parameter blocks: orientation q (4, x y z w, with
/// RotationManifold), translation T (3), fingers P (45). Weight: lambda_t, on the sum; residuals
/// are scaled by its square root.
class Temporal final : public ceres::SizedCostFunction<51, 4, 3, kHandDofs> {
 public:
  Temporal(const Eigen::Quaterniond& orientation, const Eigen::Vector3d& translation,
           const FingerPose& fingers, double weight)
      : orientation_(orientation),
        translation_(translation),
        fingers_(fingers),
        scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Map<const Eigen::Quaterniond> q(parameters[0]);
    Eigen::Map<Eigen::Matrix<double, 51, 1>> r(residuals);
    const Eigen::Vector3d turn = LogSO3((orientation_.conjugate() * q).toRotationMatrix());
    r.head<3>() = scale_ * turn;
    r.segment<3>(3) = scale_ * (Eigen::Map<const Eigen::Vector3d>(parameters[1]) - translation_);
    r.tail<kHandDofs>() = scale_ * (Eigen::Map<const FingerPose>(parameters[2]) - fingers_);
    if (jacobians == nullptr) return true;
    if (jacobians[0] != nullptr) {
      // log(exp(turn) exp(delta)) = turn + Jr^{-1}(turn) delta, and Jr(w) = Jl(w)^T.
      Eigen::Matrix3d J_turn_delta = InverseLeftJacobianSO3(turn).transpose();
      Eigen::Map<Eigen::Matrix<double, 51, 4, Eigen::RowMajor>> J(jacobians[0]);
      J.setZero();
      J.topRows<3>() = scale_ * RotationManifold::Lift(J_turn_delta, parameters[0]);
    }
    if (jacobians[1] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 51, 3, Eigen::RowMajor>> J(jacobians[1]);
      J.setZero();
      J.middleRows<3>(3).diagonal().setConstant(scale_);
    }
    if (jacobians[2] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 51, kHandDofs, Eigen::RowMajor>> J(jacobians[2]);
      J.setZero();
      J.bottomRows<kHandDofs>().diagonal().setConstant(scale_);
    }
    return true;
  }

  /// The energy as in the paper, without weight.
  static double Energy(const Eigen::Quaterniond& orientation_prev,
                       const Eigen::Vector3d& translation_prev, const FingerPose& fingers_prev,
                       const Eigen::Quaterniond& orientation, const Eigen::Vector3d& translation,
                       const FingerPose& fingers) {
    return LogSO3((orientation_prev.conjugate() * orientation).toRotationMatrix()).squaredNorm() +
           (translation - translation_prev).squaredNorm() + (fingers - fingers_prev).squaredNorm();
  }

 private:
  Eigen::Quaterniond orientation_;
  Eigen::Vector3d translation_;
  FingerPose fingers_;
  double scale_;
};

}  // namespace holdfast
