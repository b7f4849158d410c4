// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>

#include <Eigen/Core>

#include "geometry/clip/clip.h"
#include "geometry/rotation.h"
#include "solver/hand/hand_axes.h"

namespace holdfast {

/// A finger joint that turns by more than this from one frame to the next jumps, radians.
inline constexpr double kFingerJump = 40.0 * kDegree;

/// What became of one hand's fingers.
struct FingerRepair {
  Side side = Side::kRight;
  bool moves = false;   ///< a finger turns somewhere; hands that were not captured do not
  int jump_frames = 0;  ///< frames into which a finger joint jumped
  int replaced = 0;     ///< rotations of finger joints that were replaced, of 15 a frame
};

/// Frames, from 1, into which a finger joint of this hand jumps.
int FingerJumpFrames(const Clip& clip, Side side);

/// Brings fingers that jump to rest; `axes` are of the hand that is repaired in `clip`. A capture's
/// solver that finds another posture for a while leaves bursts and steps, and what filters them
/// overshoots beside them. Of every joint the most frames are kept that agree with one another,
///
///   angle(q_s, q_t) <= w (t - s)   for kept frames s < t that follow each other,
///
/// w 1200 degrees a second and at most 30 a frame (found over all frames at once, by dynamic
/// programming); others go the shortest way from kept frame to kept frame. Then every angle a of
/// the hand (HandAxes) is the least of
///
///   sum_t c_t (a_t - d_t)^2 + v (a_{t+1} - 2 a_t + a_{t-1})^2 + 10 max(0, a_t beyond its range)^2
///
/// d what the clip has now, c 1 for kept frames and 0.1 for others, v for a smoothing length of two
/// frames at 60 Hz. A hand without jumps stays as it is.
FingerRepair RepairFingers(const HandAxes& axes, Clip& clip);

/// Gaussian over time of each row of `values` (d x T), weights renormalized at both ends.
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
