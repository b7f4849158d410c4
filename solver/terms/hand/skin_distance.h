// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/mesh/distance_grid.h"
#include "solver/hand/hand_evaluation.h"
#include "solver/hand/hand_landmarks.h"
#include "solver/unknowns/rotation_manifold.h"

namespace holdfast {

/// What penetration and contact have in common: one residual for each of some points x of the skin,
/// a function of its signed distance d to the object's surface,
///
///   r_i = Shape(d(z_i)),   z_i = R^T (x_i(P) - T)
///
/// Parameter blocks: object rotation R (unit quaternion x, y, z, w with RotationManifold), object
/// translation T (3, metres, the frame of the hand), finger pose P (45, radians).
///
/// `Shape` is a callable: double distance -> {residual, d residual / d distance}.
template <typename Shape>
class SkinDistanceTerm : public ceres::CostFunction {
 public:
  /// `hand` and `object` must outlive the term.
  SkinDistanceTerm(HandEvaluation& hand, const DistanceGrid& object, std::vector<SkinPoint> points,
                   Shape shape)
      : hand_(hand), object_(object), points_(std::move(points)), shape_(std::move(shape)) {
    set_num_residuals(static_cast<int>(points_.size()));
    *mutable_parameter_block_sizes() = {4, 3, kHandDofs};
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Map<const Eigen::Quaterniond> q(parameters[0]);
    const Eigen::Map<const Eigen::Vector3d> T(parameters[1]);
    const Eigen::Matrix3d R = q.toRotationMatrix();
    double* const J_rotation = jacobians ? jacobians[0] : nullptr;
    double* const J_translation = jacobians ? jacobians[1] : nullptr;
    double* const J_fingers = jacobians ? jacobians[2] : nullptr;
    const Eigen::Matrix3Xd& vertices = hand_.At(parameters[2], J_fingers != nullptr).Vertices();

    for (std::size_t i = 0; i < points_.size(); ++i) {
      const SkinPoint& point = points_[i];
      const Eigen::Vector3d x = 0.5 * (vertices.col(point.a) + vertices.col(point.b));
      const Eigen::Vector3d z = R.transpose() * (x - T);
      const std::pair<double, double> shaped = ShapedAt(i, z);
      residuals[i] = shaped.first;
      if (!jacobians) continue;
      Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
      if (shaped.second != 0.0) object_.Distance(z, &gradient);
      gradient *= shaped.second;
      if (J_rotation) {
        // R exp(delta): z moves by -delta x z.
        const Eigen::RowVector3d J_delta = z.cross(gradient).transpose() * -1.0;
        Eigen::Map<Eigen::RowVector4d>(J_rotation + 4 * i) =
            RotationManifold::Lift(J_delta, parameters[0]);
      }
      const Eigen::Vector3d in_hand_frame = R * gradient;
      if (J_translation) Eigen::Map<Eigen::RowVector3d>(J_translation + 3 * i) = -in_hand_frame;
      if (J_fingers) {
        double* const row = J_fingers + kHandDofs * i;
        std::fill(row, row + kHandDofs, 0.0);
        if (shaped.second == 0.0) continue;
        hand_.AddRow(point.a, 0.5 * in_hand_frame, row);
        hand_.AddRow(point.b, 0.5 * in_hand_frame, row);
      }
    }
    return true;
  }

 private:
  // The grid's distance, interpolated, changes by less than twice what the point moves: where the
  // shape is flat for all that it can have become it is not asked for.
  std::pair<double, double> ShapedAt(std::size_t i, const Eigen::Vector3d& z) const {
    Known& known = known_[i];
    if (known.room > 0.0 && (z - known.at).squaredNorm() < known.room * known.room) return {};
    const double distance = object_.Distance(z);
    const std::pair<double, double> shaped = shape_(distance);
    known = {z, 0.0};
    const auto flat = [&](double d) { return shape_(d) == std::pair(0.0, 0.0); };
    for (double room = 0.004; room > 0.0004 && known.room == 0.0; room *= 0.5) {
      if (flat(distance - 2.0 * room)) known.room = room;
    }
    return shaped;
  }
  struct Known {
    Eigen::Vector3d at;
    double room = 0.0;  // around it the residual and its slope are zero
  };

  HandEvaluation& hand_;
  const DistanceGrid& object_;
  std::vector<SkinPoint> points_;
  Shape shape_;
  mutable std::vector<Known> known_{points_.size()};
};

}  // namespace holdfast
