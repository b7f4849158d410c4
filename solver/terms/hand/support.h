// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/rotation.h"
#include "solver/unknowns/rotation_manifold.h"

namespace holdfast {

/// An object on a table or the ground does not sink into it. Over its vertices o_j,
///
///   E = sum_j max(0, height - (R o_j + T).z)^2,   m^2
///
/// One residual a vertex, metres. Parameter blocks: orientation q (4, x y z w, with
/// RotationManifold), translation T (3, metres, world). `weight` (1/m^2) on the sum. Where the
/// object lies meanwhile is ObjectData towards its resting pose.
class Support final : public ceres::CostFunction {
 public:
  /// `vertices` (3 x n) in the object's frame; `height_m` of the support, world z. `vertices` must
  /// outlive the term.
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
