// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "geometry/mesh/distance_grid.h"
#include "solver/hand/hand_landmarks.h"
#include "solver/terms/hand/skin_distance.h"
#include "solver/unknowns/skin_term.h"

namespace holdfast {

/// r = w max(0, clearance - d): skin below the surface by more than -clearance is pushed out.
/// A negative clearance is what soft tissue may give.
struct PenetrationShape {
  double weight = 1.0;     ///< per metre
  double clearance = 0.0;  ///< metres

  std::pair<double, double> operator()(double distance) const {
    const double depth = clearance - distance;
    if (depth <= 0.0) return {0.0, 0.0};
    return {weight * depth, -weight};
  }
};

/// Hand in object, as a residual block of its own: E = sum_i w^2 max(0, clearance - d_i)^2 over
/// points of the skin. For grasps, where the points are few.
using PenetrationTerm = SkinDistanceTerm<PenetrationShape>;

/// Hand in object, for the fit: the same energy over all skin points (vertices and middles of
/// edges, so that nothing thicker than about 3 mm passes between them),
///
///   E_p = sum_i max(0, -d(z_i) - give)^2,   m^2
///
/// d the object's signed distance (negative inside) at skin point z_i in the object's frame, give
/// the depth that soft tissue takes. One row for each point that is deeper. Weight: lambda_p, on
/// the sum; not part of the paper's energy.
class Penetration final : public SkinTerm {
 public:
  /// `landmarks` and `object` must outlive the term.
  Penetration(const HandLandmarks& landmarks, const DistanceGrid& object, double give_m,
              double weight)
      : landmarks_(landmarks), object_(object), shape_{std::sqrt(weight), -give_m} {
    for (const SkinPoint& point : landmarks.Skin()) watched_.push_back({point, 0.0});
  }

  /// Keeps the points near the surface. Does nothing while the hand has hardly moved on the object
  /// since the last call.
  bool Watch(const Eigen::Matrix3Xd& z) override {
    constexpr double kMargin = 0.002;    // of movement before points are chosen anew
    constexpr double kReach = 0.006;     // of one frame's solve, from anywhere within the margin
    constexpr double kHalfEdge = 0.004;  // an edge's middle is nearer than its ends by this at most
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
      // The grid's distance, interpolated, changes by less than twice what the point moves.
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
    double distance;  // where the hand was at watched_at_
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

}  // namespace holdfast
