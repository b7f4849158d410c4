// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include <ceres/cost_function.h>

#include <Eigen/Core>

#include "solver/unknowns/free_pose.h"

namespace holdfast {

/// A shape and a pose's freedom that the terms of all frames share.
struct MarkedBody {
  FreePose free;
  Eigen::Matrix3Xd rest_joints;  ///< (3 x 55) at betas zero, metres
  Eigen::MatrixXd J_rest;        ///< d rest joints / d betas (165 x B)
  std::vector<int> joint;        ///< that each of M markers follows

  int NumShape() const { return static_cast<int>(J_rest.cols()); }
  int NumMarkers() const { return static_cast<int>(joint.size()); }
  Eigen::Matrix3Xd RestJoints(const double* betas) const {
    Eigen::Matrix3Xd joints = rest_joints;
    Eigen::Map<Eigen::VectorXd>(joints.data(), joints.size()) +=
        J_rest * Eigen::Map<const Eigen::VectorXd>(betas, J_rest.cols());
    return joints;
  }
};

/// Markers seen in a frame.
struct SeenMarkers {
  std::vector<int> marker;      ///< of the M
  Eigen::Matrix3Xd place;       ///< world, metres
  std::vector<double> sigma_m;  ///< one standard deviation of each

  int Count() const { return static_cast<int>(marker.size()); }
};

/// Markers are where the body carries them (Loper et al. 2014, eq. 4), far ones count little:
///
///   r_k = g(|d_k|) d_k / sigma_k,  d_k = p_j + R_j x_k - m_k,  g(s) = c sqrt(log(1 + s^2/c^2)) / s
///
/// 3 residuals a seen marker, metres over metres; |r|^2 is Cauchy's loss with scale c. p, R: joint
/// j that marker k follows; x_k its place in the joint's frame. Blocks: root (6), q (n), betas (B),
/// places x (3 M).
class MarkerDistance final : public ceres::CostFunction {
 public:
  /// `body` must outlive it.
  MarkerDistance(const MarkedBody& body, SeenMarkers seen, double scale_m)
      : body_(body), seen_(std::move(seen)), scale_(scale_m) {
    set_num_residuals(3 * seen_.Count());
    *mutable_parameter_block_sizes() = {FreePose::kRootSize, body.free.Size(), body.NumShape(),
                                        3 * body.NumMarkers()};
  }

  bool Evaluate(double const* const* x, double* residuals, double** J) const override {
    FreePoseState state;
    state.Evaluate(body_.free, body_.RestJoints(x[2]), x[0], x[1], J != nullptr);
    using RowMajor = FreePoseState::RowMajor;
    for (int b = 0; J != nullptr && b < 4; ++b) {
      if (J[b] != nullptr) {
        Eigen::Map<RowMajor>(J[b], num_residuals(), parameter_block_sizes()[b]).setZero();
      }
    }
    const auto rows = [&](int block, int k) {
      const int columns = parameter_block_sizes()[block];
      return Eigen::Map<RowMajor>(J[block] + 3 * k * columns, 3, columns);
    };
    for (int k = 0; k < seen_.Count(); ++k) {
      const int marker = seen_.marker[k], joint = body_.joint[marker];
      const Eigen::Map<const Eigen::Vector3d> in_joint(x[3] + 3 * marker);
      const Eigen::Vector3d world = state.Point(joint, in_joint);
      const Eigen::Vector3d d = world - seen_.place.col(k);
      const auto [g, slope] = Robust(d.norm());
      Eigen::Map<Eigen::Vector3d>(residuals + 3 * k) = g * d / seen_.sigma_m[k];
      if (J == nullptr) continue;
      // d (g d) = (g I + g'/s d d^T) dd.
      const Eigen::Matrix3d weight =
          (g * Eigen::Matrix3d::Identity() + slope * d * d.transpose()) / seen_.sigma_m[k];
      if (J[0] != nullptr) rows(0, k) = weight * state.RootJacobian(world);
      if (J[1] != nullptr) state.AddPoseJacobian(joint, world, weight, rows(1, k));
      if (J[2] != nullptr) rows(2, k) = weight * state.ShapeJacobian(joint, body_.J_rest);
      if (J[3] != nullptr) {
        rows(3, k).middleCols<3>(3 * marker) = weight * state.Body().world_rotation[joint];
      }
    }
    return true;
  }

 private:
  // g and g'(s) / s.
  std::pair<double, double> Robust(double s) const {
    const double c2 = scale_ * scale_, u = s * s / c2;
    if (u < 1e-6) return {1.0 - 0.25 * u, -0.5 / c2};
    const double rho = std::log1p(u), g = std::sqrt(rho / u);
    // g^2 = log(1 + u) / u, u' = 2 s / c^2.
    return {g, (1.0 / (1.0 + u) - rho / u) / (u * g * c2)};
  }

  const MarkedBody& body_;
  SeenMarkers seen_;
  double scale_;
};

}  // namespace holdfast
