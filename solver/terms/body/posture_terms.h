// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include <ceres/cost_function.h>
#include <ceres/sized_cost_function.h>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "generator/body/limb_ik.h"
#include "generator/matching/foot_lock.h"
#include "geometry/rotation.h"
#include "solver/unknowns/upper_body_chain.h"

namespace holdfast {

/// Balance: keeps the center of mass above the feet as in the capture, however far the body bends.
///
///   r = (c(x) - captured) / sigma,   2 residuals (ground plane)
///
/// c: weighted mean of trunk, head and reaching arm, with weights from an adult's segment masses
/// (de Leva 1996; half of the legs' mass is added to the pelvis, as they follow it). x: the frame's
/// change (UpperBodyDofs, 28); meters.
struct Balance {
  static constexpr int kRows = 2;
  Eigen::Vector2d captured = Eigen::Vector2d::Zero();
  double sigma_m = 0.04;

  /// Joints with weights of sum 1.
  static std::array<std::pair<int, double>, 5> Masses(const UpperBodyChain& chain) {
    return {{{0, 0.42},
             {9, 0.38},
             {15, 0.10},
             {chain.ElbowJoint(), 0.06},
             {chain.WristJointId(), 0.04}}};
  }
  static Eigen::Vector2d Middle(const UpperBodyChain& chain, const BodyPlacement& placed) {
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    for (const auto& [joint, weight] : Masses(chain)) {
      middle += weight * placed.joints.col(joint).head<2>();
    }
    return middle;
  }

  template <typename Residuals, typename Jacobian>
  void Evaluate(const UpperBodyChain& chain, const UpperBodyState& state, Residuals&& residuals,
                Jacobian&& J_residuals_change) const {
    residuals = (Middle(chain, state.Placed()) - captured) / sigma_m;
    J_residuals_change.setZero();
    for (const auto& [joint, weight] : Masses(chain)) {
      const J_point_change J_point = state.PointJacobian(joint);
      J_residuals_change += weight / sigma_m * J_point.topRows<2>();
    }
  }
};

/// Joint limits taken from captured bodies; the elbow is limited between straight and fully flexed.
///
///   r_j = max(0, |log(S_j exp(x_j))| - limit_j) / sigma   8 residuals: spine1, spine2, spine3,
///                                                         collar, shoulder, neck, head, (elbow)
///   r_elbow = (max(0, f - highest) - max(0, lowest - f)) / sigma,  f = captured flexion + x
///
/// x: the frame's change (UpperBodyDofs, 28); radians. Where the capture itself exceeds a limit,
/// the limit is the captured angle: see Of.
struct JointRange {
  static constexpr int kRows = 8;
  static constexpr std::array<int, 7> kColumns = {
      UpperBodyDofs::kSpine,  UpperBodyDofs::kSpine + 3, UpperBodyDofs::kSpine + 6,
      UpperBodyDofs::kCollar, UpperBodyDofs::kShoulder,  UpperBodyDofs::kNeck,
      UpperBodyDofs::kHead};

  std::array<Eigen::Matrix3d, 7> captured;  ///< S_j
  std::array<double, 7> limit;              ///< radians
  double elbow = 0.0;                       ///< captured flexion
  double lowest_elbow = 0.05, highest_elbow = 2.5;
  double sigma_rad = 0.02;

  static std::array<int, 7> Joints(const UpperBodyChain& chain) {
    return {3, 6, 9, chain.CollarJoint(), chain.ShoulderJoint(), 12, 15};
  }

  /// `limits`: maximum angle of each of the 22 joints, radians.
  static JointRange Of(const UpperBodyChain& chain, const BodyFrame& frame,
                       const std::array<double, kNumBodyJoints>& limits) {
    JointRange range;
    const std::array<int, 7> joints = Joints(chain);
    for (std::size_t k = 0; k < joints.size(); ++k) {
      range.captured[k] = frame.local[joints[k]].toRotationMatrix();
      range.limit[k] = std::max(limits[joints[k]], LogSO3(range.captured[k]).norm());
    }
    range.elbow = chain.ElbowFlexion(frame);
    range.lowest_elbow = std::min(range.lowest_elbow, range.elbow);
    range.highest_elbow = std::max(range.highest_elbow, range.elbow);
    return range;
  }

  template <typename Residuals, typename Jacobian>
  void Evaluate(const UpperBodyChain&, const UpperBodyState&, const UpperBodyChange& change,
                Residuals&& residuals, Jacobian&& J_residuals_change) const {
    residuals.setZero();
    J_residuals_change.setZero();
    for (int k = 0; k < 7; ++k) {
      const Eigen::Vector3d x = change.segment<3>(kColumns[static_cast<std::size_t>(k)]);
      const Eigen::Vector3d turn = LogSO3(captured[static_cast<std::size_t>(k)] * ExpSO3(x));
      const double angle = turn.norm();
      const double beyond = angle - limit[static_cast<std::size_t>(k)];
      if (beyond <= 0.0) continue;
      residuals(k) = beyond / sigma_rad;
      // d log(S exp(x)) = Jr^-1(turn) Jr(x) dx, and turn^T Jr^-1(turn) = turn^T.
      J_residuals_change.template block<1, 3>(k, kColumns[static_cast<std::size_t>(k)]) =
          turn.transpose() / (angle * sigma_rad) * LeftJacobianSO3(-x);
    }
    const double flexion = elbow + change(UpperBodyDofs::kElbow);
    residuals(7) =
        (std::max(0.0, flexion - highest_elbow) - std::max(0.0, lowest_elbow - flexion)) /
        sigma_rad;
    J_residuals_change(7, UpperBodyDofs::kElbow) =
        flexion > highest_elbow || flexion < lowest_elbow ? 1.0 / sigma_rad : 0.0;
  }
};

/// Keeps the hips where the legs reach the fixed ankles: neither too far nor too near.
///
///   r_k = max(0, |h_k(x) - a_k| - longest_k) / sigma                 2 residuals (left, right)
///   r_k+2 = max(0, shortest - |h_k(x) - a_k|) / sigma                2 residuals
///
/// x: the frame's change (UpperBodyDofs, 28); meters. If the captured leg is straighter than the
/// limit, `longest` is the captured length.
struct LegReach {
  static constexpr int kRows = 4;
  std::array<Eigen::Vector3d, 2> ankle = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  std::array<double, 2> longest = {0.8, 0.8};
  double shortest = 0.3;
  double sigma_m = 0.004;

  /// For a captured frame with target feet `feet`: knee flexion between 4 and 140 degrees.
  static LegReach Of(const UpperBodyChain& chain, const BodyPlacement& placed,
                     const FeetTarget& feet) {
    LegReach legs;
    for (const std::size_t k : {0u, 1u}) {
      Limb leg = Leg(k == 0 ? Side::kLeft : Side::kRight);
      leg.min_flexion_rad = 4.0 * kDegree;
      leg.max_flexion_rad = 140.0 * kDegree;
      legs.ankle[k] = feet.ankle[k];
      const double captured = (placed.joints.col(leg.root) - feet.ankle[k]).norm();
      legs.longest[k] = std::max(captured, MaxReach(chain.RestJoints(), leg));
      legs.shortest = MinReach(chain.RestJoints(), leg);
    }
    return legs;
  }

  template <typename Residuals, typename Jacobian>
  void Evaluate(const UpperBodyChain&, const UpperBodyState& state, Residuals&& residuals,
                Jacobian&& J_residuals_change) const {
    for (int k = 0; k < 2; ++k) {
      const int hip = 1 + k;
      const Eigen::Vector3d leg =
          state.Placed().joints.col(hip) - ankle[static_cast<std::size_t>(k)];
      const double length = leg.norm();
      const double beyond = length - longest[static_cast<std::size_t>(k)];
      const double within = shortest - length;
      residuals(k) = std::max(0.0, beyond) / sigma_m;
      residuals(k + 2) = std::max(0.0, within) / sigma_m;
      const Eigen::Matrix<double, 1, UpperBodyDofs::kSize> J_length =
          leg.transpose() / length * state.PointJacobian(hip);
      J_residuals_change.row(k) = (beyond > 0.0 ? 1.0 / sigma_m : 0.0) * J_length;
      J_residuals_change.row(k + 2) = (within > 0.0 ? -1.0 / sigma_m : 0.0) * J_length;
    }
  }
};

/// Keeps the pelvis upright (standing or sitting) when no marker shows it.
///
///   r = (R e_y - e_z) / sigma,   3 residuals; sigma is about radians
///
/// Parameter block: root (6) of FreePose; R = exp(its last three entries). World z is up.
class PelvisUpright final : public ceres::SizedCostFunction<3, 6> {
 public:
  explicit PelvisUpright(double sigma) : sigma_(sigma) {}

  bool Evaluate(double const* const* x, double* residuals, double** J) const override {
    const Eigen::Vector3d turn = Eigen::Map<const Eigen::Vector3d>(x[0] + 3);
    const Eigen::Vector3d up = ExpSO3(turn).col(1);
    Eigen::Map<Eigen::Vector3d>{residuals} = (up - Eigen::Vector3d::UnitZ()) / sigma_;
    if (J != nullptr && J[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 3, 6, Eigen::RowMajor>> J_root(J[0]);
      J_root.leftCols<3>().setZero();
      J_root.rightCols<3>() = -Skew<double>(up) * LeftJacobianSO3(turn) / sigma_;
    }
    return true;
  }

 private:
  double sigma_;
};

/// Smoothness: a joint that is not observed for a while continues its motion.
///
///   r = (q_t-1 - 2 q_t + q_t+1) / sigma,   n residuals
///
/// q: pose parameters (FreePose) in three frames, one block each; sigma (n): standard deviation of
/// the acceleration times the square of the frame interval, radians or meters.
class PoseAcceleration final : public ceres::CostFunction {
 public:
  explicit PoseAcceleration(Eigen::VectorXd sigma) : weight_(sigma.cwiseInverse()) {
    set_num_residuals(static_cast<int>(weight_.size()));
    mutable_parameter_block_sizes()->assign(3, static_cast<int>(weight_.size()));
  }

  bool Evaluate(double const* const* x, double* residuals, double** J) const override {
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const Eigen::Index n = weight_.size();
    const Eigen::Map<const Eigen::VectorXd> a(x[0], n), b(x[1], n), c(x[2], n);
    Eigen::Map<Eigen::VectorXd>(residuals, n) = weight_.cwiseProduct(a - 2.0 * b + c);
    for (int k = 0; J != nullptr && k < 3; ++k) {
      if (J[k] == nullptr) continue;
      Eigen::Map<RowMajor> J_q(J[k], n, n);
      J_q.setZero();
      J_q.diagonal() = (k == 1 ? -2.0 : 1.0) * weight_;
    }
    return true;
  }

 private:
  Eigen::VectorXd weight_;
};

/// Joint limit: low <= axis^T q_j <= high.
struct PoseLimit {
  int column = 0;                                   ///< of the first entry of `axis` in q
  Eigen::VectorXd axis = Eigen::Vector3d::UnitY();  ///< unit
  double low = 0.0, high = 0.0;                     ///< radians
};

/// Rest pose prior for unobserved joints, and joint limits.
///
///   r   = W (q - rest)                                                  n residuals
///   r_l = (max(0, a_l - high_l) - max(0, low_l - a_l)) / sigma          one per limit
///
/// a_l: the limit's component of q (FreePose), radians; W: square root of the inverse covariance.
/// Parameter block: q (n).
class PoseRest final : public ceres::CostFunction {
 public:
  PoseRest(Eigen::VectorXd rest, Eigen::MatrixXd root_information, std::vector<PoseLimit> limits,
           double sigma_rad)
      : rest_(std::move(rest)),
        W_(std::move(root_information)),
        limits_(std::move(limits)),
        sigma_(sigma_rad) {
    set_num_residuals(static_cast<int>(W_.rows()) + static_cast<int>(limits_.size()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(rest_.size()));
  }

  bool Evaluate(double const* const* x, double* residuals, double** J) const override {
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const Eigen::Map<const Eigen::VectorXd> q(x[0], rest_.size());
    Eigen::Map<Eigen::VectorXd> r(residuals, num_residuals());
    r.head(W_.rows()) = W_ * (q - rest_);
    const bool with_jacobian = J != nullptr && J[0] != nullptr;
    Eigen::Map<RowMajor> J_q(with_jacobian ? J[0] : nullptr, num_residuals(), rest_.size());
    if (with_jacobian) {
      J_q.setZero();
      J_q.topRows(W_.rows()) = W_;
    }
    for (std::size_t l = 0; l < limits_.size(); ++l) {
      const PoseLimit& limit = limits_[l];
      const Eigen::Index row = W_.rows() + static_cast<Eigen::Index>(l);
      const double a = limit.axis.dot(q.segment(limit.column, limit.axis.size()));
      r(row) = (std::max(0.0, a - limit.high) - std::max(0.0, limit.low - a)) / sigma_;
      if (with_jacobian && r(row) != 0.0) {
        J_q.row(row).segment(limit.column, limit.axis.size()) = limit.axis.transpose() / sigma_;
      }
    }
    return true;
  }

 private:
  Eigen::VectorXd rest_;
  Eigen::MatrixXd W_;
  std::vector<PoseLimit> limits_;
  double sigma_;
};

/// Target orientation of the chest.
///
///   r = [u(x) - up;  f(x) - forward] / sigma,   6 residuals; u, f: the chest's y and z axes, world
///
/// x: the frame's change (UpperBodyDofs, 28). `up` and `forward` are unit vectors; `sigma` is about
/// radians.
struct TrunkLean {
  static constexpr int kRows = 6;
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d forward = -Eigen::Vector3d::UnitY();
  double sigma = 0.1;

  template <typename Residuals, typename Jacobian>
  void Evaluate(const UpperBodyChain&, const UpperBodyState& state, Residuals&& residuals,
                Jacobian&& J_residuals_change) const {
    constexpr int kChestJoint = 9;
    const Eigen::Vector3d u = state.Placed().rotation[kChestJoint].col(1);
    const Eigen::Vector3d f = state.Placed().rotation[kChestJoint].col(2);
    residuals.template head<3>() = (u - up) / sigma;
    residuals.template tail<3>() = (f - forward) / sigma;
    J_residuals_change.template topRows<3>() = state.DirectionJacobian(kChestJoint, u) / sigma;
    J_residuals_change.template bottomRows<3>() = state.DirectionJacobian(kChestJoint, f) / sigma;
  }
};

}  // namespace holdfast
