// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <optional>
#include <utility>

#include <ceres/cost_function.h>
#include <Eigen/Core>

#include "geometry/mesh/distance_grid.h"
#include "solver/unknowns/free_pose.h"
#include "solver/unknowns/upper_body_chain.h"

namespace holdfast {

/// Gaze: keeps the offset between head direction and reaching goal as it was in the capture.
///
///   r = (f(x) - wanted) / sigma,   3 residuals; f: face direction, world, unit
///
/// x: the frame's change (UpperBodyDofs, 28). `wanted` is a unit vector; `sigma` is about radians.
struct Gaze {
  static constexpr int kRows = 3;
  Eigen::Vector3d wanted = -Eigen::Vector3d::UnitY();
  double sigma = 0.3;

  template <typename Residuals, typename Jacobian>
  void Evaluate(const UpperBodyChain&, const UpperBodyState& state, Residuals&& residuals,
                Jacobian&& J_residuals_change) const {
    constexpr int kHeadJoint = 15;
    const Eigen::Vector3d face = state.Placed().rotation[kHeadJoint].col(2);
    residuals = (face - wanted) / sigma;
    J_residuals_change = state.DirectionJacobian(kHeadJoint, face) / sigma;
  }
};

/// Keeps points outside the head and moves the lips to a target.
///
///   r_l = (p + R l - m) / sigma_lips                  3 residuals, if the lips have a target
///   r_i = max(0, margin - d(R^T (x_i - p))) / sigma   one per point
///
/// p, R: head joint pose, world; l: lips in the head frame; m: target of the lips; x_i: points to
/// keep outside the head, world; d: signed distance of the head's skin in the head frame; meters.
/// Parameter block: q (n), of a pose with a fixed root.
class HeadPlace final : public ceres::CostFunction {
 public:
  struct Head {
    const DistanceGrid& skin;
    Eigen::Vector3d lips;
    double lips_sigma_m = 0.003, margin_m = 0.003, sigma_m = 0.001;
  };

  /// All arguments but `points` must outlive it.
  HeadPlace(const FreePose& free, const Eigen::Matrix3Xd& rest_joints,
            const Eigen::Matrix<double, 6, 1>& root, const Head& head,
            std::optional<Eigen::Vector3d> lips_at, Eigen::Matrix3Xd points)
      : free_(free),
        rest_joints_(rest_joints),
        root_(root),
        head_(head),
        lips_at_(std::move(lips_at)),
        points_(std::move(points)) {
    set_num_residuals((lips_at_ ? 3 : 0) + static_cast<int>(points_.cols()));
    mutable_parameter_block_sizes()->push_back(free.Size());
  }

  bool Evaluate(double const* const* x, double* residuals, double** J) const override {
    using RowMajor = FreePoseState::RowMajor;
    const bool with_jacobian = J != nullptr && J[0] != nullptr;
    FreePoseState state;
    state.Evaluate(free_, rest_joints_, root_.data(), x[0], with_jacobian);
    Eigen::Map<RowMajor> J_q(with_jacobian ? J[0] : nullptr, num_residuals(), free_.Size());
    if (with_jacobian) J_q.setZero();
    int row = 0;
    if (lips_at_) {
      const Eigen::Vector3d lips = state.Point(kHead, head_.lips);
      Eigen::Map<Eigen::Vector3d> r(residuals);
      r = (lips - *lips_at_) / head_.lips_sigma_m;
      if (with_jacobian) {
        const Eigen::Matrix3d weight = Eigen::Matrix3d::Identity() / head_.lips_sigma_m;
        state.AddPoseJacobian(kHead, lips, weight, J_q.topRows<3>());
      }
      row = 3;
    }
    const Eigen::Matrix3d& R = state.Body().world_rotation[kHead];
    const Eigen::Vector3d p = state.Body().joints.col(kHead);
    RowMajor J_point(3, free_.Size());
    for (Eigen::Index i = 0; i < points_.cols(); ++i, ++row) {
      Eigen::Vector3d gradient;
      const double off =
          head_.skin.Distance(R.transpose() * (points_.col(i) - p), &gradient) - head_.margin_m;
      residuals[row] = std::max(0.0, -off) / head_.sigma_m;
      if (!with_jacobian || off >= 0.0) continue;
      // The point is fixed; the skin moves like a point attached to the head there.
      J_point.setZero();
      state.AddPoseJacobian(kHead, points_.col(i), Eigen::Matrix3d::Identity(), J_point);
      J_q.row(row) = (R * gradient).transpose() * J_point / head_.sigma_m;
    }
    return true;
  }

 private:
  const FreePose& free_;
  const Eigen::Matrix3Xd& rest_joints_;
  Eigen::Matrix<double, 6, 1> root_;
  const Head& head_;
  std::optional<Eigen::Vector3d> lips_at_;
  Eigen::Matrix3Xd points_;
};

/// Wrist target that blends from a place in the world to a place fixed to the head: an object at
/// the mouth follows the mouth, and the mouth approaches the object.
///
///   r = (w(x) - (1 - s) q - s (h(x) + A(x) p)) / sigma,   3 residuals
///
/// w: wrist joint, world; h, A: position and rotation of the head joint; q: target in the world; p:
/// target in the head frame; s: weight of the head target. x: the frame's change (UpperBodyDofs,
/// 28). Meters; `sigma_m` is the standard deviation.
struct HeldAtFace {
  static constexpr int kRows = 3;
  double share = 0.0;
  Eigen::Vector3d in_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d in_head = Eigen::Vector3d::Zero();
  double sigma_m = 0.01;

  template <typename Residuals, typename Jacobian>
  void Evaluate(const UpperBodyChain& chain, const UpperBodyState& state, Residuals&& residuals,
                Jacobian&& J_residuals_change) const {
    constexpr int kHeadJoint = 15;
    const BodyPlacement& placed = state.Placed();
    const int wrist = chain.WristJointId();
    const Eigen::Vector3d from_head = placed.rotation[kHeadJoint] * in_head;
    residuals = (placed.joints.col(wrist) - (1.0 - share) * in_world -
                 share * (placed.joints.col(kHeadJoint) + from_head)) /
                sigma_m;
    J_residuals_change =
        (state.PointJacobian(wrist) - share * (state.PointJacobian(kHeadJoint) +
                                               state.DirectionJacobian(kHeadJoint, from_head))) /
        sigma_m;
  }
};

/// Wrist position target.
///
///   r = (w(x) - target) / sigma,   3 residuals; w: wrist joint, world, meters
///
/// x: the frame's change (UpperBodyDofs, 28). `sigma_m`: standard deviation in meters.
struct WristGoal {
  static constexpr int kRows = 3;
  Eigen::Vector3d target = Eigen::Vector3d::Zero();
  double sigma_m = 0.01;

  template <typename Residuals, typename Jacobian>
  void Evaluate(const UpperBodyChain& chain, const UpperBodyState& state, Residuals&& residuals,
                Jacobian&& J_residuals_change) const {
    const int wrist = chain.WristJointId();
    residuals = (state.Placed().joints.col(wrist) - target) / sigma_m;
    J_residuals_change = state.PointJacobian(wrist) / sigma_m;
  }
};

}  // namespace holdfast
