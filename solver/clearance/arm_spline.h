// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include <ceres/sized_cost_function.h>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "generator/body/limb_ik.h"
#include "geometry/body/body_model.h"
#include "geometry/rotation.h"

namespace holdfast {

/// Change of one arm in one frame: collar, shoulder, elbow, wrist, three parameters each. Rotations
/// R_j = S_j exp(x_j) with S_j from the clip, radians.
using ArmChange = Eigen::Matrix<double, 12, 1>;
using J_point_arm = Eigen::Matrix<double, 3, 12>;

/// Joints of an arm, proximal to distal.
enum ArmJoint : int { kArmCollar, kArmShoulder, kArmElbow, kArmWrist };
/// Index of the joint in SMPL-X.
inline constexpr int JointOfArm(Side side, int joint) {
  constexpr int kRight[] = {kRightCollar, kRightShoulder, kRightElbow, kRightWrist};
  return kRight[joint] - (side == Side::kLeft ? 1 : 0);
}

/// One frame's arm in the clip.
struct ArmFrame {
  std::array<Eigen::Matrix3d, 4> local;  ///< S_j
  std::array<Eigen::Vector3d, 4> bone;   ///< from the parent joint, in its frame, meters
  Eigen::Isometry3d chest;               ///< world pose of the collar's parent

  /// `state` must have the joints of the frame (ForwardJoints).
  ArmFrame(const Eigen::Matrix3Xd& rest_joints, Side side, const BodyState& state);
};

/// The arm after a change, with its derivatives. Scratch.
class ArmState {
 public:
  void Evaluate(const ArmFrame& frame, const ArmChange& change);

  const Eigen::Isometry3d& WorldFrom(int joint) const { return world_[joint]; }
  /// d (world position `point` of a point fixed to `joint`) / d change.
  J_point_arm PointJacobian(int joint, const Eigen::Vector3d& point) const;
  /// Derivative of the world rotation vector of `joint` by the change: d R = [J dx]x R.
  J_point_arm TurnJacobian(int joint) const;

 private:
  std::array<Eigen::Isometry3d, 4> world_;
  std::array<Eigen::Matrix3d, 4> J_omega_;
};

/// Prior on the control points of an arm's change: small and smooth.
///
///   r = [c_1 / sigma;  (c_0 - 2 c_1 + c_2) / (bend sigma)],   24 residuals
///
/// Parameter blocks: c_0, c_1, c_2 (12 each). `sigma`: per degree of freedom, radians.
class ArmSplinePrior final : public ceres::SizedCostFunction<24, 12, 12, 12> {
 public:
  ArmSplinePrior(const ArmChange& sigma, double bend)
      : inverse_(sigma.cwiseInverse()), bend_(bend) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    using Map = Eigen::Map<const ArmChange>;
    const Map c0(parameters[0]), c1(parameters[1]), c2(parameters[2]);
    Eigen::Map<Eigen::Matrix<double, 24, 1>> r(residuals);
    r << c1.cwiseProduct(inverse_), (c0 - 2.0 * c1 + c2).cwiseProduct(inverse_) / bend_;
    for (int k = 0; jacobians != nullptr && k < 3; ++k) {
      if (jacobians[k] == nullptr) continue;
      Eigen::Map<Eigen::Matrix<double, 24, 12, Eigen::RowMajor>> J(jacobians[k]);
      J.setZero();
      if (k == 1) J.topRows<12>().diagonal() = inverse_;
      J.bottomRows<12>().diagonal() = (k == 1 ? -2.0 : 1.0) / bend_ * inverse_;
    }
    return true;
  }

 private:
  ArmChange inverse_;
  double bend_;
};

/// Change of an arm over time: a uniform cubic B-spline with a control point every `knot_frames`
/// frames, initially zero.
class ArmSpline {
 public:
  ArmSpline(int num_frames, double knot_frames)
      : knot_frames_(knot_frames),
        knots_(static_cast<std::size_t>((num_frames - 1) / knot_frames) + 4, ArmChange::Zero()) {}

  /// Index of the first of the four control points around frame t, and their weights.
  std::pair<int, Eigen::Vector4d> Place(int t) const {
    const double place = t / knot_frames_;
    const int knot = std::min(static_cast<int>(place), Size() - 4);
    const double u = place - knot, v = 1.0 - u;
    return {knot, Eigen::Vector4d(v * v * v, 3.0 * u * u * u - 6.0 * u * u + 4.0,
                                  3.0 * v * v * v - 6.0 * v * v + 4.0, u * u * u) /
                      6.0};
  }
  ArmChange At(int t) const {
    const auto [knot, basis] = Place(t);
    ArmChange change = ArmChange::Zero();
    for (int k = 0; k < 4; ++k) change += basis(k) * knots_[knot + k];
    return change;
  }
  int Size() const { return static_cast<int>(knots_.size()); }
  double* Knot(int k) { return knots_[k].data(); }

 private:
  double knot_frames_;
  std::vector<ArmChange> knots_;
};

/// Joint limits of elbow and wrist, widened to the clip's own angles.
///
///   r_k = (max(0, a_k - highest_k) - max(0, lowest_k - a_k)) / sigma,   4 residuals
///
/// a: elbow flexion about its hinge, wrist flexion, ulnar deviation, twist of the forearm (of elbow
/// and wrist together): components of log(S_j exp(x_j)), radians. x: the arm's change (12). Limits
/// from Limb and WristLimits.
struct ArmRange {
  static constexpr int kRows = 4;
  Eigen::Matrix3d elbow, wrist;     ///< S_j
  Eigen::Matrix3d axes;             ///< columns: elbow's hinge; wrist: flexion, ulnar
  Eigen::Vector4d lowest, highest;  ///< radians
  double sigma_rad = 2.0 * kDegree;

  ArmRange(Side side, const ArmFrame& frame)
      : elbow(frame.local[kArmElbow]), wrist(frame.local[kArmWrist]) {
    const double sign = side == Side::kRight ? 1.0 : -1.0;
    const Limb arm = Arm(side);
    const WristLimits limits;
    axes << arm.hinge, sign * Eigen::Vector3d::UnitZ(), -sign * Eigen::Vector3d::UnitY();
    const Eigen::Vector4d now = Angles(LogSO3(elbow), LogSO3(wrist));
    lowest = Eigen::Vector4d(arm.min_flexion_rad, limits.flexion_min, limits.ulnar_min,
                             -limits.twist_max)
                 .cwiseMin(now);
    highest =
        Eigen::Vector4d(arm.max_flexion_rad, limits.flexion_max, limits.ulnar_max, limits.twist_max)
            .cwiseMax(now);
  }

  Eigen::Vector4d Angles(const Eigen::Vector3d& elbow_turn,
                         const Eigen::Vector3d& wrist_turn) const {
    return {axes.col(0).dot(elbow_turn), axes.col(1).dot(wrist_turn), axes.col(2).dot(wrist_turn),
            elbow_turn.x() + wrist_turn.x()};
  }

  template <typename Residuals, typename Jacobian>
  void Evaluate(const ArmChange& change, Residuals&& residuals,
                Jacobian&& J_residuals_change) const {
    const Eigen::Vector3d at_elbow = change.segment<3>(3 * kArmElbow),
                          at_wrist = change.segment<3>(3 * kArmWrist);
    const Eigen::Vector3d elbow_turn = LogSO3(elbow * ExpSO3(at_elbow)),
                          wrist_turn = LogSO3(wrist * ExpSO3(at_wrist));
    const Eigen::Vector4d angles = Angles(elbow_turn, wrist_turn);
    J_residuals_change.setZero();
    for (int k = 0; k < kRows; ++k) {
      residuals(k) =
          (std::max(0.0, angles(k) - highest(k)) - std::max(0.0, lowest(k) - angles(k))) /
          sigma_rad;
      if (residuals(k) == 0.0) continue;
      // log(S exp(x + dx)) = log(S exp(x)) + Jr^-1(turn) Jr(x) dx.
      const Eigen::Vector3d axis = k < 3 ? Eigen::Vector3d(axes.col(k)) : Eigen::Vector3d::UnitX();
      if (k == 0 || k == 3) {
        J_residuals_change.template block<1, 3>(k, 3 * kArmElbow) =
            axis.transpose() * InverseLeftJacobianSO3(-elbow_turn) * LeftJacobianSO3(-at_elbow) /
            sigma_rad;
      }
      if (k > 0) {
        J_residuals_change.template block<1, 3>(k, 3 * kArmWrist) =
            axis.transpose() * InverseLeftJacobianSO3(-wrist_turn) * LeftJacobianSO3(-at_wrist) /
            sigma_rad;
      }
    }
  }
};

}  // namespace holdfast
