// SPDX-License-Identifier: MIT
#include "solver/handover/dwell_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Cholesky>

#include "generator/scripted/minimum_jerk.h"

namespace holdfast {
namespace {

constexpr double kAround_s = 0.30;  // of the motions before and after
constexpr double kShift_s = 0.30;   // maximum shift of either end from the guess
constexpr std::array<double, 4> kDurations_s = {0.45, 0.6, 0.8, 1.1};

}  // namespace

Dwell FitDwell(const Eigen::Matrix3Xd& between, double frame_rate, const Dwell& guess) {
  const auto frames = static_cast<int>(between.cols());
  const int around = static_cast<int>(std::lround(kAround_s * frame_rate));
  const int first = std::max(0, static_cast<int>(std::floor(guess.begin)) - around);
  const int last = std::min(frames - 1, static_cast<int>(std::ceil(guess.end)) + around);
  const int count = last - first + 1;
  if (count < 8) return guess;
  const Eigen::MatrixX3d seen = between.middleCols(first, count).transpose();
  const double seen_squared = seen.squaredNorm();
  const int steps = static_cast<int>(std::lround(2.0 * kShift_s * frame_rate));

  // Columns of the two motions for every end and duration; all sums are over the window.
  struct Column {
    double at;
    Eigen::VectorXd values;
    double sum, squared;
    Eigen::RowVector3d with_seen;
  };
  const auto columns = [&](double from, int sign) {
    std::vector<Column> all;
    for (int s = -steps; s <= steps; ++s) {
      const double at = from + 0.5 * s;
      if (at < first || at > last) continue;
      for (const double duration : kDurations_s) {
        Column column{at, Eigen::VectorXd(count), 0.0, 0.0, {}};
        for (int i = 0; i < count; ++i) {
          column.values(i) = MinimumJerk(sign * (first + i - at) / (frame_rate * duration));
        }
        column.sum = column.values.sum();
        column.squared = column.values.squaredNorm();
        column.with_seen = column.values.transpose() * seen;
        all.push_back(std::move(column));
      }
    }
    return all;
  };
  const std::vector<Column> before = columns(guess.begin, -1), after = columns(guess.end, 1);
  const Eigen::RowVector3d seen_sum = seen.colwise().sum();

  Dwell best = guess;
  double least = std::numeric_limits<double>::infinity();
  for (const Column& a : before) {
    for (const Column& b : after) {
      if (b.at < a.at) continue;
      const double ab = a.values.dot(b.values);
      // Small damping: a motion that is not observed should not be fitted.
      constexpr double kSmall = 1e-6;
      Eigen::Matrix3d normal;
      normal << count, a.sum, b.sum, a.sum, a.squared + kSmall, ab, b.sum, ab, b.squared + kSmall;
      Eigen::Matrix3d right;
      right << seen_sum, a.with_seen, b.with_seen;
      const Eigen::Matrix3d solved = normal.ldlt().solve(right);
      const double residual = seen_squared - (solved.array() * right.array()).sum();
      if (residual < least) {
        least = residual;
        best = {a.at, b.at};
      }
    }
  }
  return best;
}

namespace {

// -log sum exp(-x), for costs that may be infinite.
double SoftMinimum(const Eigen::VectorXd& x) {
  const double least = x.minCoeff();
  if (!std::isfinite(least)) return least;
  return least - std::log((least - x.array()).exp().sum());
}

}  // namespace

StatePath ViterbiPath(const Eigen::MatrixXd& costs, const Eigen::MatrixXd& change) {
  const Eigen::Index steps = costs.cols();
  StatePath path;
  path.posterior.resize(costs.rows(), steps);
  if (steps == 0) return path;

  Eigen::MatrixXi from(costs.rows(), steps);
  Eigen::MatrixXd forward(costs.rows(), steps);
  Eigen::VectorXd best = costs.col(0);
  forward.col(0) = costs.col(0);
  for (Eigen::Index t = 1; t < steps; ++t) {
    Eigen::VectorXd next(costs.rows());
    for (Eigen::Index s = 0; s < costs.rows(); ++s) {
      Eigen::Index least;
      next(s) = costs(s, t) + (best + change.col(s)).minCoeff(&least);
      from(s, t) = static_cast<int>(least);
      forward(s, t) = costs(s, t) + SoftMinimum(forward.col(t - 1) + change.col(s));
    }
    best = next;
  }
  Eigen::Index state;
  path.cost = best.minCoeff(&state);
  path.states.resize(static_cast<std::size_t>(steps));
  for (Eigen::Index t = steps - 1; t >= 0; --t) {
    path.states[static_cast<std::size_t>(t)] = static_cast<int>(state);
    if (t > 0) state = from(state, t);
  }

  Eigen::VectorXd backward = Eigen::VectorXd::Zero(costs.rows());
  for (Eigen::Index t = steps - 1; t >= 0; --t) {
    const Eigen::VectorXd total = forward.col(t) + backward;
    path.posterior.col(t) = (SoftMinimum(total) - total.array()).exp();
    if (t == 0) break;
    const Eigen::VectorXd behind = costs.col(t) + backward;
    for (Eigen::Index s = 0; s < costs.rows(); ++s) {
      backward(s) = SoftMinimum(change.row(s).transpose() + behind);
    }
  }
  return path;
}

}  // namespace holdfast
