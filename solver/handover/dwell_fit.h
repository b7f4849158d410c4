// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

namespace holdfast {

/// When two hands were together: frames, not whole ones, [begin, end].
struct Dwell {
  double begin = 0.0, end = 0.0;
  double Middle() const { return 0.5 * (begin + end); }
};

/// Finds when the hands come together and part, around a first guess. `between` (3 x T) is the way
/// from one hand's holding place to the other's, metres, any noise; it stands still while both hold
/// one thing. Least squares over the guess and `kAround_s` on either side of
///
///   between(t) = p + a m((begin - t) / A) + b m((t - end) / B),   m minimum jerk (MinimumJerk),
///
/// over begin and end in half frames, and A and B between 0.4 and 1.1 s; p, a and b follow. A
/// threshold on the distance would find them late where hands part slowly and noise is large.
/// Returns the guess where there are too few frames.
Dwell FitDwell(const Eigen::Matrix3Xd& between, double frame_rate, const Dwell& guess);

}  // namespace holdfast
