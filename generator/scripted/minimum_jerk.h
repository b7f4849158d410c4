// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

namespace holdfast {

/// Progress of a minimum-jerk movement from rest to rest at the fraction `tau` of its duration:
/// 10 tau^3 - 15 tau^4 + 6 tau^5, 0 before and 1 after (Flash & Hogan 1985, eq. 3).
double MinimumJerk(double tau);

/// A point that a movement passes through.
struct Waypoint {
  double time_s = 0.0;
  Eigen::VectorXd value;  ///< any dimension, the same for all waypoints
  bool rest = false;      ///< stops here (velocity and acceleration are zero)
};

/// The curve through waypoints that minimizes the integral of its squared third derivative: quintic
/// pieces with four continuous derivatives at via points (Flash & Hogan 1985, sec. 4). Velocity and
/// acceleration are zero at the first and last waypoint and at each waypoint with `rest`. The curve
/// is constant before the first and after the last waypoint.
class MinimumJerkSpline {
 public:
  /// Throws Error if there are no waypoints, times are not finite and increasing, or dimensions
  /// differ.
  explicit MinimumJerkSpline(std::span<const Waypoint> waypoints);

  Eigen::VectorXd Value(double time_s) const { return Evaluate(time_s, 0); }
  /// d^order value / dt^order for order 0..5, per second^order.
  Eigen::VectorXd Derivative(double time_s, int order) const { return Evaluate(time_s, order); }

  double EndTime() const { return times_.back(); }

 private:
  Eigen::VectorXd Evaluate(double time_s, int order) const;

  std::vector<double> times_;
  // Per piece: six polynomial coefficients (columns) in the normalized time of the piece.
  std::vector<Eigen::Matrix<double, Eigen::Dynamic, 6>> pieces_;
  Eigen::VectorXd last_value_;
};

}  // namespace holdfast
