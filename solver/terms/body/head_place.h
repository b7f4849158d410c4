// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <optional>
#include <utility>

#include <ceres/cost_function.h>

#include <Eigen/Core>

#include "geometry/mesh/distance_grid.h"
#include "solver/unknowns/free_pose.h"

namespace holdfast {

/// A head keeps out of the way, and brings its lips to a place.
///
///   r_l = (p + R l - m) / sigma_lips                  3 residuals, where the lips are wanted
///   r_i = max(0, margin - d(R^T (x_i - p))) / sigma   one a point
///
/// p, R: the head joint in the world; l: lips in its frame; m: where they are wanted; x_i: points
/// that keep out of the head, world; d: signed distance of the head's skin in its frame; metres.
/// Block: q (n), of a pose whose root is held.
class HeadPlace final : public ceres::CostFunction {
 public:
  struct Head {
    const DistanceGrid& skin;
    Eigen::Vector3d lips;
    double lips_sigma_m = 0.003, margin_m = 0.003, sigma_m = 0.001;
  };

  /// All but `points` must outlive it.
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
      // The point stays and the skin moves as what is fixed to the head there.
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

}  // namespace holdfast
