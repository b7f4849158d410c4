// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <utility>
#include <vector>

#include <ceres/cost_function.h>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/mesh/distance_grid.h"
#include "solver/hand/hand_evaluation.h"
#include "solver/hand/hand_landmarks.h"
#include "solver/terms/hand/hand_term.h"
#include "solver/unknowns/rotation_manifold.h"

namespace holdfast {

/// Common base of penetration and contact terms: one residual per skin point x, a function of its
/// signed distance d to the object's surface,
///
///   r_i = Shape(d(z_i)),   z_i = R^T (x_i(P) - T)
///
/// Parameter blocks: object rotation R (unit quaternion x, y, z, w with RotationManifold), object
/// translation T (3, meters, frame of the hand), finger pose P (45, radians).
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
  // The interpolated distance of the grid changes by less than twice the displacement of the point.
  // If the shape is flat over that range, the distance is not queried.
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
    double room = 0.0;  // radius within which residual and slope are zero
  };

  HandEvaluation& hand_;
  const DistanceGrid& object_;
  std::vector<SkinPoint> points_;
  Shape shape_;
  mutable std::vector<Known> known_{points_.size()};
};

/// r = w max(0, clearance - d): pushes out skin that is deeper than -clearance. A negative
/// clearance is the compression that soft tissue allows.
struct PenetrationShape {
  double weight = 1.0;     ///< per meter
  double clearance = 0.0;  ///< meters

  std::pair<double, double> operator()(double distance) const {
    const double depth = clearance - distance;
    if (depth <= 0.0) return {0.0, 0.0};
    return {weight * depth, -weight};
  }
};

/// Hand in object as a separate residual block: E = sum_i w^2 max(0, clearance - d_i)^2 over skin
/// points. For grasps, where the points are few.
using PenetrationTerm = SkinDistanceTerm<PenetrationShape>;

/// Hand in object, for the fit: the same energy over all skin points (vertices and edge midpoints,
/// so that nothing thicker than about 3 mm passes between them),
///
///   E_p = sum_i max(0, -d(z_i) - give)^2,   m^2
///
/// d: the object's signed distance (negative inside) at skin point z_i in the object frame; give:
/// depth that soft tissue allows. One row per point that is deeper. Weight: lambda_p, on the sum;
/// not part of the paper's energy.
class Penetration final : public SkinTerm {
 public:
  /// `landmarks` and `object` must outlive the term.
  Penetration(const HandLandmarks& landmarks, const DistanceGrid& object, double give_m,
              double weight)
      : landmarks_(landmarks), object_(object), shape_{std::sqrt(weight), -give_m} {
    for (const SkinPoint& point : landmarks.Skin()) watched_.push_back({point, 0.0});
  }

  /// Keeps the points near the surface. Does nothing while the hand has hardly moved relative to
  /// the object since the last call.
  bool Watch(const Eigen::Matrix3Xd& z) override {
    constexpr double kMargin = 0.002;    // displacement that triggers a new selection
    constexpr double kReach = 0.006;     // of one frame's solve, from anywhere within the margin
    constexpr double kHalfEdge = 0.004;  // maximum by which an edge midpoint is nearer than its
                                         // ends
    if (watched_at_.cols() == z.cols() &&
        (watched_at_ - z).colwise().squaredNorm().maxCoeff() < kMargin * kMargin) {
      return false;
    }
    watched_at_ = z;
    distances_.resize(z.cols());
    for (Eigen::Index i = 0; i < z.cols(); ++i) distances_(i) = object_.Distance(z.col(i));
    watched_.clear();
    for (const SkinPoint& point : landmarks_.Skin()) {
      const double nearest = std::min(distances_(point.a), distances_(point.b));
      if (nearest >= kReach + (point.a == point.b ? 0.0 : kHalfEdge)) continue;
      watched_.push_back({point, point.a == point.b ? nearest : object_.Distance(At(z, point))});
    }
    return true;
  }

  void Forget() override { watched_at_.resize(3, 0); }
  double Add(const Eigen::Matrix3Xd& z, SkinRows& rows) const override {
    double energy = 0.0;
    const bool chosen = watched_at_.cols() == z.cols();
    for (const Watched& watched : watched_) {
      const SkinPoint& point = watched.point;
      // The interpolated distance of the grid changes by less than twice the point's displacement.
      const double room = 0.5 * (watched.distance - shape_.clearance);
      if (chosen && room > 0.0 &&
          (At(z, point) - At(watched_at_, point)).squaredNorm() < room * room) {
        continue;
      }
      Eigen::Vector3d gradient;
      const double distance = object_.Distance(At(z, point), &gradient);
      const auto [residual, slope] = shape_(distance);
      if (residual == 0.0) continue;
      rows.Begin(residual);
      if (point.a == point.b) {
        rows.Add(point.a, slope * gradient);
      } else {
        rows.Add(point.a, 0.5 * slope * gradient);
        rows.Add(point.b, 0.5 * slope * gradient);
      }
      const double depth = residual / shape_.weight;
      energy += depth * depth;
    }
    return energy;
  }

 private:
  struct Watched {
    SkinPoint point;
    double distance;  // at watched_at_
  };
  static Eigen::Vector3d At(const Eigen::Matrix3Xd& z, const SkinPoint& point) {
    return 0.5 * (z.col(point.a) + z.col(point.b));
  }

  const HandLandmarks& landmarks_;
  const DistanceGrid& object_;
  PenetrationShape shape_;
  std::vector<Watched> watched_;
  Eigen::VectorXd distances_;
  Eigen::Matrix3Xd watched_at_;
};

/// A surface point o of the object inside the hand, and the skin over it: a point of one triangle.
struct Intrusion {
  Eigen::Vector3d point;       ///< o, object frame, meters
  std::array<int, 3> corners;  ///< vertices of the triangle
  Eigen::Vector3d shares;      ///< barycentric coordinates of the skin point, sum 1
  Eigen::Vector3d outward;     ///< unit, from o to the skin point, hand frame
};

/// Edges and thin walls of the object inside the hand without a skin point inside them (like
/// ObjectInHand, for a few iterations around one pose). The skin is moved back over each,
///
///   r_j = w max(0, n_j . (s_j(P) - R o_j - T)),   s_j = sum_k shares_jk x_k(P)
///
/// Parameter blocks: object rotation R (unit quaternion x, y, z, w with RotationManifold), object
/// translation T (3, meters, frame of the hand), finger pose P (45, radians).
class IntrusionTerm final : public ceres::CostFunction {
 public:
  /// `hand` must outlive the term. `weight` is per meter.
  IntrusionTerm(HandEvaluation& hand, std::vector<Intrusion> intrusions, double weight)
      : hand_(hand), intrusions_(std::move(intrusions)), weight_(weight) {
    set_num_residuals(static_cast<int>(intrusions_.size()));
    *mutable_parameter_block_sizes() = {4, 3, kHandDofs};
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Matrix3d R =
        Eigen::Map<const Eigen::Quaterniond>(parameters[0]).toRotationMatrix();
    const Eigen::Map<const Eigen::Vector3d> T(parameters[1]);
    double* const J_rotation = jacobians ? jacobians[0] : nullptr;
    double* const J_translation = jacobians ? jacobians[1] : nullptr;
    double* const J_fingers = jacobians ? jacobians[2] : nullptr;
    const Eigen::Matrix3Xd& vertices = hand_.At(parameters[2], J_fingers != nullptr).Vertices();
    for (std::size_t j = 0; j < intrusions_.size(); ++j) {
      const Intrusion& in = intrusions_[j];
      Eigen::Vector3d skin = Eigen::Vector3d::Zero();
      for (int k = 0; k < 3; ++k) skin += in.shares[k] * vertices.col(in.corners[k]);
      const double depth = in.outward.dot(skin - R * in.point - T);
      residuals[j] = weight_ * std::max(0.0, depth);
      const Eigen::Vector3d slope =
          depth > 0.0 ? Eigen::Vector3d(weight_ * in.outward) : Eigen::Vector3d::Zero();
      if (J_rotation) {
        // R exp(delta): R o moves by R (delta x o).
        const Eigen::RowVector3d J_delta = -in.point.cross(R.transpose() * slope).transpose();
        Eigen::Map<Eigen::RowVector4d>(J_rotation + 4 * j) =
            RotationManifold::Lift(J_delta, parameters[0]);
      }
      if (J_translation) Eigen::Map<Eigen::RowVector3d>(J_translation + 3 * j) = -slope;
      if (!J_fingers) continue;
      double* const row = J_fingers + kHandDofs * j;
      std::fill(row, row + kHandDofs, 0.0);
      if (depth <= 0.0) continue;
      for (int k = 0; k < 3; ++k) hand_.AddRow(in.corners[k], in.shares[k] * slope, row);
    }
    return true;
  }

 private:
  HandEvaluation& hand_;
  std::vector<Intrusion> intrusions_;
  double weight_;
};

}  // namespace holdfast
