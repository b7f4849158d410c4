// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

namespace holdfast {

/// How far a minimum-jerk movement from rest to rest has come at the fraction `tau` of its
/// duration: 10 tau^3 - 15 tau^4 + 6 tau^5, 0 before and 1 after (Flash & Hogan 1985, eq. 3).
double MinimumJerk(double tau);

/// A place a movement goes through.
struct Waypoint {
  double time_s = 0.0;
  Eigen::VectorXd value;  ///< any dimension, the same for all
  bool rest = false;      ///< comes to a stop here (velocity and acceleration zero)
};

/// The curve through waypoints that minimizes the integral of its squared third derivative: quintic
/// pieces with four continuous derivatives where it passes through (Flash & Hogan 1985, sec. 4),
/// velocity and acceleration zero at the first, the last, and every waypoint of rest. Before the
/// first and after the last it stands still.
class MinimumJerkSpline {
 public:
  /// Throws Error for no waypoints, times that do not increase or are not finite, and values of
  /// different dimensions.
  explicit MinimumJerkSpline(std::span<const Waypoint> waypoints);

  Eigen::VectorXd Value(double time_s) const { return Evaluate(time_s, 0); }
  /// d^order value / dt^order, order 0..5, per second^order.
  Eigen::VectorXd Derivative(double time_s, int order) const { return Evaluate(time_s, order); }

  double StartTime() const { return times_.front(); }
  double EndTime() const { return times_.back(); }

 private:
  Eigen::VectorXd Evaluate(double time_s, int order) const;

  std::vector<double> times_;
  // Per piece: six polynomial coefficients (columns) of the fraction of the piece's duration.
  std::vector<Eigen::Matrix<double, Eigen::Dynamic, 6>> pieces_;
  Eigen::VectorXd last_value_;
};

}  // namespace holdfast
