// SPDX-License-Identifier: MIT
#include "solver/handover/viterbi.h"

#include <cmath>

namespace holdfast {
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
