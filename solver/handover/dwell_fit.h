// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

namespace holdfast {

/// Interval in which two hands are together: fractional frames, [begin, end].
struct Dwell {
  double begin = 0.0, end = 0.0;
  double Middle() const { return 0.5 * (begin + end); }
};

/// Finds when the hands come together and part, near a first guess. `between` (3 x T): displacement
/// from one hand's holding point to the other's, meters, with any noise; constant while both hold
/// one object. Least-squares fit over the guess and `kAround_s` on either side of
///
///   between(t) = p + a m((begin - t) / A) + b m((t - end) / B),   m minimum jerk (MinimumJerk),
///
/// over begin and end in half frames, and A and B between 0.4 and 1.1 s; p, a and b follow
/// linearly. A distance threshold would detect them late when hands part slowly and noise is large.
/// Returns the guess if there are too few frames.
Dwell FitDwell(const Eigen::Matrix3Xd& between, double frame_rate, const Dwell& guess);

/// Most likely state sequence and the posterior of each of its steps.
struct StatePath {
  std::vector<int> states;    ///< T states
  Eigen::MatrixXd posterior;  ///< (S x T) state probabilities per step; columns sum to 1
  double cost = 0.0;          ///< of the sequence, nats
};

/// Viterbi algorithm: returns the path with minimum sum of `costs` (S x T, negative
/// log-likelihoods, nats; infinity forbids) and of `change(from, to)` (S x S, nats) between steps.
/// The posterior is that of the hidden Markov model with these costs (forward-backward). Ties go to
/// the lower state. Zero steps give an empty path.
StatePath ViterbiPath(const Eigen::MatrixXd& costs, const Eigen::MatrixXd& change);

}  // namespace holdfast
