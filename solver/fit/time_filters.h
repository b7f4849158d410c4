// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>

#include <Eigen/Core>

namespace holdfast {

/// Gaussian over time of each row of `values` (d x T), weights renormalised at both ends.
Eigen::MatrixXd GaussianFilter(const Eigen::MatrixXd& values, double sigma_frames);

/// What GaussianFilter leaves of the standard deviation of white noise, in (0, 1].
double NoiseAfterSmoothing(double sigma_frames);

/// Least-squares slope over `reach` frames to either side (fewer at the ends), per frame (3 x T).
/// `value(t, u)`, a vector, is frame u as seen from frame t: rotations have no other way to be
/// subtracted.
template <typename Value>
Eigen::Matrix3Xd SlopesOverTime(Eigen::Index frames, Eigen::Index reach, const Value& value) {
  Eigen::Matrix3Xd slopes = Eigen::Matrix3Xd::Zero(3, frames);
  for (Eigen::Index t = 0; t < frames; ++t) {
    const Eigen::Index begin = std::max<Eigen::Index>(0, t - reach);
    const Eigen::Index end = std::min(frames, t + reach + 1);
    const double middle = 0.5 * static_cast<double>(begin + end - 1);
    double squares = 0.0;
    for (Eigen::Index u = begin; u < end; ++u) {
      const double k = static_cast<double>(u) - middle;
      slopes.col(t) += k * value(t, u);
      squares += k * k;
    }
    if (squares > 0.0) slopes.col(t) /= squares;
  }
  return slopes;
}

inline Eigen::Matrix3Xd SlopesOverTime(const Eigen::Matrix3Xd& values, Eigen::Index reach) {
  return SlopesOverTime(values.cols(), reach,
                        [&](Eigen::Index, Eigen::Index u) { return values.col(u); });
}

/// What SlopesOverTime makes of the standard deviation of white noise, per frame.
double NoiseOfSlope(Eigen::Index reach);

/// Standard deviation per axis of what changes from frame to frame without going anywhere: from
/// the median of second differences, which steady movement does not enter. 0 below five frames.
double WhiteNoise(const Eigen::Matrix3Xd& positions);

}  // namespace holdfast
