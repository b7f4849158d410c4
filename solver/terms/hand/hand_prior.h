// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include <ceres/cost_function.h>
#include <ceres/sized_cost_function.h>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/rotation.h"
#include "solver/hand/hand_axes.h"
#include "solver/hand/hand_evaluation.h"
#include "solver/hand/hand_landmarks.h"
#include "solver/unknowns/rotation_manifold.h"
#include "solver/unknowns/wrist_offset.h"

namespace holdfast {

/// Weights of HandPriorTerm, all per radian.
struct HandPriorWeights {
  double limits = 10.0;    ///< angle beyond its range
  double coupling = 0.5;   ///< deviation of the last joint from 2/3 of the middle one
  double neighbors = 1.0;  ///< flexion difference of adjacent finger roots above 50 degrees
  double stay = 0.2;       ///< deviation of any angle from the preferred pose
  double spread = 0.0;     ///< additional, deviation of spread and twist from it
};

/// Prior on finger angles. With a = HandAxes::AnglesOf(P), 97 residuals:
///
///   45  w_limits  (a - clamp(a))
///    4  w_coupling ((a_dip + rest_dip) - 2/3 (a_pip + rest_pip))    fingers, not the thumb
///    3  w_neighbors hinge(|a_mcp - a_mcp'| - 50 deg)               index-middle-ring-pinky
///   45  w_stay (+ w_spread for rows 1 and 2)  (a - preferred)
///
/// Parameter block: finger pose P (45, radians).
class HandPriorTerm final : public ceres::SizedCostFunction<97, kHandDofs> {
 public:
  /// `axes` must outlive the term.
  HandPriorTerm(const HandAxes& axes, const HandAngles& preferred, const HandPriorWeights& weights)
      : axes_(axes), preferred_(preferred), weights_(weights) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const HandAngles angles = axes_.AnglesOf(Eigen::Map<const FingerPose>(parameters[0]));
    Eigen::Map<Eigen::Matrix<double, 97, kHandDofs, Eigen::RowMajor>> J(
        jacobians && jacobians[0] ? jacobians[0] : nullptr);
    const bool with_jacobian = jacobians && jacobians[0];
    if (with_jacobian) J.setZero();
    // The axis of an angle is its row of the Jacobian.
    const auto add = [&](int row, double scale, int angle_row, int joint) {
      if (with_jacobian) {
        J.block<1, 3>(row, 3 * joint) += scale * axes_.Axes(joint).col(angle_row).transpose();
      }
    };

    int row = 0;
    for (int k = 0; k < kJointsPerHand; ++k) {
      for (int c = 0; c < 3; ++c, ++row) {
        const AngleRange& range = axes_.Range(c, k);
        const double excess = angles(c, k) - std::clamp(angles(c, k), range.low, range.high);
        residuals[row] = weights_.limits * excess;
        if (excess != 0.0) add(row, weights_.limits, c, k);
      }
    }
    for (int finger = 0; finger < kNumFingers; ++finger) {
      if (finger == kThumb) continue;
      const int pip = 3 * finger + 1, dip = 3 * finger + 2;
      residuals[row] = weights_.coupling * (angles(0, dip) + axes_.RestFlexion(dip) -
                                            2.0 / 3.0 * (angles(0, pip) + axes_.RestFlexion(pip)));
      add(row, weights_.coupling, 0, dip);
      add(row, -2.0 / 3.0 * weights_.coupling, 0, pip);
      ++row;
    }
    constexpr int kNeighbors[4] = {3 * kIndex, 3 * kMiddle, 3 * kRing, 3 * kPinky};
    constexpr double kComfortable = 50.0 * std::numbers::pi / 180.0;
    for (int n = 0; n < 3; ++n, ++row) {
      const int a = kNeighbors[n], b = kNeighbors[n + 1];
      const double difference = angles(0, a) - angles(0, b);
      const double excess = difference - std::clamp(difference, -kComfortable, kComfortable);
      residuals[row] = weights_.neighbors * excess;
      if (excess != 0.0) {
        add(row, weights_.neighbors, 0, a);
        add(row, -weights_.neighbors, 0, b);
      }
    }
    for (int k = 0; k < kJointsPerHand; ++k) {
      for (int c = 0; c < 3; ++c, ++row) {
        const double weight = weights_.stay + (c > 0 ? weights_.spread : 0.0);
        residuals[row] = weight * (angles(c, k) - preferred_(c, k));
        add(row, weight, c, k);
      }
    }
    return true;
  }

 private:
  const HandAxes& axes_;
  HandAngles preferred_;
  HandPriorWeights weights_;
};

/// E_w: keeps the hands where they are in the input clip. With the current offset B (already
/// applied to the body) and the unknown offset (C, c) on top of it,
///
///   E_w = |c_B + B c|^2 + l^2 |log(B C)|^2,   l = 0.1 m
///
/// 6 residuals, meters: a rotation counts as the displacement at l, the length of a palm. Parameter
/// blocks: C (4, x y z w, with RotationManifold), c (3, meters), both in the wrist frame. Weight:
/// lambda_w, on the sum; residuals are scaled by its square root. Not part of the paper's energy.
class WristPrior final : public ceres::SizedCostFunction<6, 4, 3> {
 public:
  static constexpr double kLever = 0.1;  // meters

  WristPrior(const WristOffset& before, double weight)
      : before_(before), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Map<const Eigen::Quaterniond> C(parameters[0]);
    const Eigen::Map<const Eigen::Vector3d> c(parameters[1]);
    const Eigen::Vector3d turn = LogSO3((before_.rotation * C).toRotationMatrix());
    Eigen::Map<Eigen::Matrix<double, 6, 1>> r(residuals);
    r.head<3>() = scale_ * (before_.translation + before_.rotation * c);
    r.tail<3>() = scale_ * kLever * turn;
    if (jacobians == nullptr) return true;
    FillPoseJacobians(parameters, jacobians, 0, scale_, scale_ * kLever,
                      InverseLeftJacobianSO3(turn).transpose(),
                      before_.rotation.toRotationMatrix());
    return true;
  }

 private:
  WristOffset before_;
  double scale_;
};

/// Joint limits of one finger joint.
///
///   r = sqrt(w) (a - clamp(a)),   3 residuals, radians
///
/// Parameter block: the joint's angles a (3, as a column of HandAngles).
class AngleRangeTerm final : public ceres::SizedCostFunction<3, 3> {
 public:
  /// `axes` must outlive the term.
  AngleRangeTerm(const HandAxes& axes, int finger_joint, double weight)
      : axes_(axes), joint_(finger_joint), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    double* const J = jacobians != nullptr ? jacobians[0] : nullptr;
    if (J != nullptr) std::fill_n(J, 9, 0.0);
    for (int k = 0; k < 3; ++k) {
      const AngleRange& range = axes_.Range(k, joint_);
      const double beyond = parameters[0][k] - std::clamp(parameters[0][k], range.low, range.high);
      residuals[k] = scale_ * beyond;
      if (J != nullptr && beyond != 0.0) J[4 * k] = scale_;
    }
    return true;
  }

 private:
  const HandAxes& axes_;
  int joint_;
  double scale_;
};

/// Collision between fingers: for pairs of finger balls with centers c,
///
///   r = w max(0, free_distance - |c_1 - c_2|)
///
/// Parameter block: finger pose P (45, radians).
class FingerCollisionTerm final : public ceres::CostFunction {
 public:
  /// `hand` and `landmarks` must outlive the term. `weight` is per meter.
  FingerCollisionTerm(HandEvaluation& hand, const HandLandmarks& landmarks,
                      std::vector<HandLandmarks::BallPair> pairs, double weight)
      : hand_(hand), landmarks_(landmarks), pairs_(std::move(pairs)), weight_(weight) {
    set_num_residuals(static_cast<int>(pairs_.size()));
    *mutable_parameter_block_sizes() = {kHandDofs};
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const bool with_jacobian = jacobians && jacobians[0];
    const HandState& state = hand_.At(parameters[0], with_jacobian);
    Eigen::Matrix3Xd centers;
    BallCenters(landmarks_, state.Vertices(), centers);
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      const HandLandmarks::BallPair& pair = pairs_[i];
      const Eigen::Vector3d apart = centers.col(pair.first) - centers.col(pair.second);
      const double distance = apart.norm();
      const double overlap = pair.free_distance - distance;
      residuals[i] = weight_ * std::max(0.0, overlap);
      if (!with_jacobian) continue;
      double* const row = jacobians[0] + kHandDofs * i;
      std::fill(row, row + kHandDofs, 0.0);
      if (overlap <= 0.0 || distance == 0.0) continue;
      const Eigen::Vector3d direction = -weight_ / distance * apart;
      AddBall(pair.first, direction, row);
      AddBall(pair.second, -direction, row);
    }
    return true;
  }

 private:
  void AddBall(int ball, const Eigen::Vector3d& direction, double* row) const {
    const std::vector<int>& ring = landmarks_.Balls()[ball].ring;
    const Eigen::Vector3d share = direction / static_cast<double>(ring.size());
    for (const int vertex : ring) hand_.AddRow(vertex, share, row);
  }

  HandEvaluation& hand_;
  const HandLandmarks& landmarks_;
  std::vector<HandLandmarks::BallPair> pairs_;
  double weight_;
};

}  // namespace holdfast
