// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/mesh/distance_grid.h"

namespace holdfast {

/// Number of consecutive points that are close together in the result of InBlocks.
inline constexpr int kSampleBlock = 16;

/// Returns the points reordered into spatially compact blocks of kSampleBlock.
Eigen::Matrix3Xd InBlocks(const Eigen::Matrix3Xd& points);

/// Points (ordered by InBlocks) in their own frame, and a ball around either all of them or the
/// solid's current position plus NearSamples::kAround_m, whichever is smaller.
struct SampleSet {
  const Eigen::Matrix3Xd& points;
  Eigen::Vector3d center;
  double radius;
};

/// Caches which points of a set may be near a solid while their relative motion is small: a point
/// at distance d that moved by m is at least d - m away. Solvers move a hand by millimeters, and
/// few points of a link are near anything. Scratch object for one set and one solid.
class NearSamples {
 public:
  /// Margin around a solid's ball within which points are considered until the next update.
  static constexpr double kAround_m = 0.012;

  /// Calls visit(index, position in the solid's frame), in the set's order, for all points that may
  /// be closer than `reach` (meters, up to a few millimeters) to the solid, and for some others.
  template <typename Visit>
  void ForNear(const SampleSet& set, const DistanceGrid& solid,
               const Eigen::Isometry3d& solid_from_points, double reach, const Visit& visit) {
    double moved = Moved(solid_from_points);
    if (!(moved < kFarthest_m)) {
      Begin(set, solid, solid_from_points, reach);
      moved = 0.0;
    }
    const double most = reach + kSlack_m + kSlope * moved;
    for (const auto& [distance, index] : near_) {
      if (distance > most) continue;
      visit(index, Eigen::Vector3d(solid_from_points * set.points.col(index)));
    }
  }

 private:
  // An interpolated distance changes slightly faster than the displacement.
  static constexpr double kFarthest_m = 0.005, kSlack_m = 5e-4, kSlope = 1.5;

  // Bound on the displacement of the ball's points since Begin. Points outside the ball approach
  // the solid's center by at most this: rotation about it does not bring them nearer.
  double Moved(const Eigen::Isometry3d& now) const {
    if (!begun_) return std::numeric_limits<double>::infinity();
    return (now * center_ - then_ * center_).norm() +
           radius_ * (now.linear() - then_.linear()).norm();
  }

  void Begin(const SampleSet& set, const DistanceGrid& solid,
             const Eigen::Isometry3d& solid_from_points, double reach) {
    begun_ = true;
    then_ = solid_from_points;
    center_ = set.center;
    radius_ = set.radius + 1e-6;  // rounding
    near_.clear();
    const double most = reach + kSlack_m + kSlope * kFarthest_m;
    // Distance from the solid of anything within `around` of a point; infinity if too far.
    const auto distance = [&](const Eigen::Vector3d& point, double around) {
      constexpr double kFar = std::numeric_limits<double>::infinity();
      if ((point - center_).norm() > radius_ + around) return kFar;
      const Eigen::Vector3d x = then_ * point;
      if (((solid.Min() - x).array().max((x - solid.Max()).array()) > most + around).any()) {
        return kFar;
      }
      const double there = solid.Linear(x);
      return there > most + around ? kFar : there;
    };
    const int count = static_cast<int>(set.points.cols());
    if (balls_.cols() == 0) balls_ = BallsAround(set.points);
    for (int block = 0; block < static_cast<int>(balls_.cols()); ++block) {
      if (std::isinf(distance(balls_.col(block).head<3>(), balls_(3, block)))) continue;
      const int end = std::min((block + 1) * kSampleBlock, count);
      for (int k = block * kSampleBlock; k < end; ++k) {
        const double near = distance(set.points.col(k), 0.0);
        if (!std::isinf(near)) near_.emplace_back(near, k);
      }
    }
  }

  // Center and radius of each block.
  static Eigen::Matrix4Xd BallsAround(const Eigen::Matrix3Xd& points);

  bool begun_ = false;
  Eigen::Isometry3d then_ = Eigen::Isometry3d::Identity();
  Eigen::Vector3d center_ = Eigen::Vector3d::Zero();  // of the set's ball at `then_`
  double radius_ = 0.0;
  Eigen::Matrix4Xd balls_;                    // BallsAround of the set
  std::vector<std::pair<double, int>> near_;  // distances at `then_`
};

}  // namespace holdfast
