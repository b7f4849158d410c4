// SPDX-License-Identifier: MIT
#include "generator/scripted/minimum_jerk.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <Eigen/LU>

#include "geometry/error.h"

namespace holdfast {
namespace {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

// The quintic on [0, 1] with given value, first and second derivative at both ends is
// c = kHermite (p0, v0, a0, p1, v1, a1), where c are the coefficients of 1, s, ..., s^5.
const Matrix6d& Hermite() {
  static const Matrix6d hermite = [] {
    Matrix6d m;
    m << 1, 0, 0, 0, 0, 0,           //
        0, 1, 0, 0, 0, 0,            //
        0, 0, 0.5, 0, 0, 0,          //
        -10, -6, -1.5, 10, -4, 0.5,  //
        15, 8, 1.5, -15, 7, -1,      //
        -6, -3, -0.5, 6, -3, 0.5;
    return m;
  }();
  return hermite;
}

// d^order/ds^order of (1, s, ..., s^5).
Eigen::Matrix<double, 6, 1> Powers(double s, int order) {
  Eigen::Matrix<double, 6, 1> powers = Eigen::Matrix<double, 6, 1>::Zero();
  for (int k = order; k < 6; ++k) {
    double factor = 1.0;
    for (int d = 0; d < order; ++d) factor *= k - d;
    powers[k] = factor * std::pow(s, k - order);
  }
  return powers;
}

// Velocity and acceleration at every waypoint between two rests (columns: 2 per waypoint). They are
// unknown at inner waypoints, where third and fourth derivatives are continuous.
Eigen::MatrixXd SolveRun(std::span<const Waypoint> run) {
  const int n = static_cast<int>(run.size());
  const Eigen::Index dimension = run[0].value.size();
  Eigen::MatrixXd derivatives = Eigen::MatrixXd::Zero(dimension, 2 * n);
  const int unknowns = 2 * (n - 2);
  if (unknowns <= 0) return derivatives;
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(unknowns, unknowns);
  Eigen::MatrixXd b = Eigen::MatrixXd::Zero(unknowns, dimension);
  for (int i = 1; i < n - 1; ++i) {
    for (int order = 3; order <= 4; ++order) {
      const int row = 2 * (i - 1) + order - 3;
      for (int side = 0; side < 2; ++side) {  // the piece that ends at i, then the next
        const int first = i - 1 + side;
        const double h = run[first + 1].time_s - run[first].time_s;
        const Eigen::Matrix<double, 1, 6> w = (side == 0 ? 1.0 : -1.0) / std::pow(h, order) *
                                              Powers(side == 0 ? 1.0 : 0.0, order).transpose() *
                                              Hermite();
        for (int end = 0; end < 2; ++end) {
          const int at = first + end;
          b.row(row) -= w[3 * end] * run[at].value.transpose();
          if (at == 0 || at == n - 1) continue;
          A(row, 2 * (at - 1)) += w[3 * end + 1] * h;
          A(row, 2 * (at - 1) + 1) += w[3 * end + 2] * h * h;
        }
      }
    }
  }
  derivatives.middleCols(2, unknowns) = A.partialPivLu().solve(b).transpose();
  return derivatives;
}

}  // namespace

double MinimumJerk(double tau) {
  tau = std::clamp(tau, 0.0, 1.0);
  return tau * tau * tau * (10.0 + tau * (-15.0 + 6.0 * tau));
}

MinimumJerkSpline::MinimumJerkSpline(std::span<const Waypoint> waypoints) {
  if (waypoints.empty()) throw Error("minimum-jerk spline", "has no waypoints", "Give one or more");
  for (std::size_t i = 0; i < waypoints.size(); ++i) {
    const std::string where = fmt::format("waypoint {}", i);
    if (!std::isfinite(waypoints[i].time_s) ||
        (i > 0 && waypoints[i].time_s <= waypoints[i - 1].time_s)) {
      throw Error(
          where,
          fmt::format("time {} s is not after that of the previous waypoint", waypoints[i].time_s),
          "Sort the waypoints by time");
    }
    if (waypoints[i].value.size() != waypoints[0].value.size() || !waypoints[i].value.allFinite()) {
      throw Error(where, "has a different dimension than the first, or values that are not finite",
                  "");
    }
    times_.push_back(waypoints[i].time_s);
  }
  last_value_ = waypoints.back().value;

  std::size_t begin = 0;
  while (begin + 1 < waypoints.size()) {
    std::size_t end = begin + 1;
    while (end + 1 < waypoints.size() && !waypoints[end].rest) ++end;
    const auto run = waypoints.subspan(begin, end - begin + 1);
    const Eigen::MatrixXd derivatives = SolveRun(run);
    for (std::size_t i = 0; i + 1 < run.size(); ++i) {
      const double h = run[i + 1].time_s - run[i].time_s;
      Eigen::Matrix<double, Eigen::Dynamic, 6> ends(last_value_.size(), 6);
      ends << run[i].value, h * derivatives.col(2 * i), h * h * derivatives.col(2 * i + 1),
          run[i + 1].value, h * derivatives.col(2 * i + 2), h * h * derivatives.col(2 * i + 3);
      pieces_.emplace_back(ends * Hermite().transpose());
    }
    begin = end;
  }
}

Eigen::VectorXd MinimumJerkSpline::Evaluate(double time_s, int order) const {
  if (pieces_.empty() || time_s >= times_.back()) {
    return order == 0 ? last_value_ : Eigen::VectorXd::Zero(last_value_.size());
  }
  if (time_s < times_.front()) {
    return order == 0 ? Eigen::VectorXd(pieces_.front().col(0))
                      : Eigen::VectorXd::Zero(last_value_.size());
  }
  const auto piece = static_cast<std::size_t>(
      std::upper_bound(times_.begin(), times_.end(), time_s) - times_.begin() - 1);
  const double h = times_[piece + 1] - times_[piece];
  const double s = (time_s - times_[piece]) / h;
  return pieces_[piece] * Powers(s, order) / std::pow(h, order);
}

}  // namespace holdfast
