// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

namespace holdfast {

/// When two hands were together: frames, not whole ones, [begin, end].
struct Dwell {
  double begin = 0.0, end = 0.0;
  double Middle() const { return 0.5 * (begin + end); }
};

/// Finds when the hands come together and part, around a first guess. `between` (3 x T) is the way
/// from one hand's holding place to the other's, meters, any noise; it stands still while both hold
/// one thing. Least squares over the guess and `kAround_s` on either side of
///
///   between(t) = p + a m((begin - t) / A) + b m((t - end) / B),   m minimum jerk (MinimumJerk),
///
/// over begin and end in half frames, and A and B between 0.4 and 1.1 s; p, a and b follow. A
/// threshold on the distance would find them late where hands part slowly and noise is large.
/// Returns the guess where there are too few frames.
Dwell FitDwell(const Eigen::Matrix3Xd& between, double frame_rate, const Dwell& guess);

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
