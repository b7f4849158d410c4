// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

namespace holdfast {

/// The likeliest sequence of states, and how sure each of its steps is.
struct StatePath {
  std::vector<int> states;    ///< T states
  Eigen::MatrixXd posterior;  ///< (S x T) probability of each state in each step; columns sum to 1
  double cost = 0.0;          ///< of the sequence, nats
};

/// Viterbi's algorithm: the path of least sum of `costs` (S x T, negative log-likelihoods, nats;
/// infinity forbids) and of `change(from, to)` (S x S, nats) between steps. The posterior is that
/// of the hidden Markov model with these costs (forward-backward). Ties go to the lower state. No
/// steps give an empty path.
StatePath ViterbiPath(const Eigen::MatrixXd& costs, const Eigen::MatrixXd& change);

}  // namespace holdfast
