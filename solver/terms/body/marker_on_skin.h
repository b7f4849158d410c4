// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/mesh/triangle_tree.h"

namespace holdfast {

/// The skin about a marker in the T-pose, in the frame of the joint that the marker follows.
struct SkinPatch {
  std::vector<int> ids;       ///< n vertices of the body
  Eigen::Matrix3Xd vertices;  ///< (3 x n) at betas zero, metres
  Eigen::MatrixXd J_betas;    ///< (3 n x B)
  Eigen::Matrix3Xi faces;
};

/// A marker that is glued to the skin is as high over it as the others of its size.
///
///   r = (s(x, betas) - h) / sigma    1 residual, metres over metres
///
/// s: distance of place x from the patch in the T-pose, positive outside. Blocks: betas (B), height
/// h (1), place x (3).
class MarkerOnSkin final : public ceres::CostFunction {
 public:
  /// `patch` must outlive it.
  MarkerOnSkin(const SkinPatch& patch, double sigma_m) : patch_(patch), sigma_(sigma_m) {
    set_num_residuals(1);
    *mutable_parameter_block_sizes() = {static_cast<int>(patch.J_betas.cols()), 1, 3};
  }

  bool Evaluate(double const* const* x, double* residuals, double** J) const override {
    const Eigen::Map<const Eigen::VectorXd> betas(x[0], patch_.J_betas.cols());
    const Eigen::Map<const Eigen::Vector3d> place(x[2]);
    Eigen::Matrix3Xd vertices = patch_.vertices;
    vertices.reshaped() += patch_.J_betas * betas;
    double nearest2 = std::numeric_limits<double>::infinity();
    Eigen::Index face = 0;
    Eigen::Vector3d point;
    for (Eigen::Index f = 0; f < patch_.faces.cols(); ++f) {
      const Eigen::Vector3i c = patch_.faces.col(f);
      const Eigen::Vector3d on =
          ClosestOnTriangle(place, vertices.col(c(0)), vertices.col(c(1)), vertices.col(c(2)))
              .point;
      const double distance2 = (place - on).squaredNorm();
      if (distance2 >= nearest2) continue;
      nearest2 = distance2;
      face = f;
      point = on;
    }
    const Eigen::Vector3i c = patch_.faces.col(face);
    const Eigen::Vector3d a = vertices.col(c(0)), ab = vertices.col(c(1)) - a,
                          ac = vertices.col(c(2)) - a;
    const Eigen::Vector3d normal = ab.cross(ac).normalized();
    const double sign = (place - point).dot(normal) < 0.0 ? -1.0 : 1.0;
    const double distance = std::sqrt(nearest2);
    // On the surface the normal is the limit of the direction to it.
    const Eigen::Vector3d out =
        distance > 1e-9 ? Eigen::Vector3d(sign / distance * (place - point)) : normal;
    residuals[0] = (sign * distance - x[1][0]) / sigma_;
    if (J != nullptr && J[0] != nullptr) {
      // The nearest point moves with its triangle; where it is on it does not matter to first
      // order.
      Eigen::Matrix<double, 3, 2> edges;
      edges << ab, ac;
      const Eigen::Vector2d uv = edges.colPivHouseholderQr().solve(point - a);
      const Eigen::Vector3d share(1.0 - uv.sum(), uv.x(), uv.y());
      Eigen::Map<Eigen::RowVectorXd> J_betas(J[0], betas.size());
      J_betas.setZero();
      for (int k = 0; k < 3; ++k) {
        J_betas -= share(k) / sigma_ * out.transpose() * patch_.J_betas.middleRows<3>(3 * c(k));
      }
    }
    if (J != nullptr && J[1] != nullptr) J[1][0] = -1.0 / sigma_;
    if (J != nullptr && J[2] != nullptr) Eigen::Map<Eigen::Vector3d>{J[2]} = out / sigma_;
    return true;
  }

 private:
  const SkinPatch& patch_;
  double sigma_;
};

}  // namespace holdfast
