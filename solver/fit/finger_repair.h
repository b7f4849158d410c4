// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>

#include <Eigen/Core>

#include "geometry/clip/clip.h"
#include "geometry/rotation.h"
#include "solver/hand/hand_axes.h"

namespace holdfast {

/// Result of repairing one hand's fingers.
struct FingerRepair {
  Side side = Side::kRight;
  bool moves = false;   ///< some finger rotates; false for hands that were not captured
  int jump_frames = 0;  ///< frames with a jump of a finger joint
  int replaced = 0;     ///< replaced finger joint rotations, of 15 per frame
};

/// Number of frames, from frame 1, in which a finger joint of this hand jumps: rotates by more than
/// 40 degrees.
int FingerJumpFrames(const Clip& clip, Side side);

/// Repairs fingers that jump; `axes` belong to the hand repaired in `clip`. A mocap solver that
/// temporarily finds another posture leaves bursts and steps, and filtering makes them overshoot.
/// For each joint, keeps the largest set of mutually consistent frames,
///
///   angle(q_s, q_t) <= w (t - s)   for consecutive kept frames s < t,
///
/// with w = 1200 degrees per second, at most 30 per frame (found over all frames at once by dynamic
/// programming). The other frames are interpolated along the shortest path. Then every angle a of
/// the hand (HandAxes) minimizes
///
///   sum_t c_t (a_t - d_t)^2 + v (a_{t+1} - 2 a_t + a_{t-1})^2 + 10 max(0, a_t beyond its range)^2
///
/// with d the current clip, c = 1 for kept frames and 0.1 for others, and v for a smoothing length
/// of two frames at 60 Hz. A hand without jumps is unchanged.
FingerRepair RepairFingers(const HandAxes& axes, Clip& clip);

/// Gaussian filter over time of each row of `values` (d x T), weights renormalized at both ends.
Eigen::MatrixXd GaussianFilter(const Eigen::MatrixXd& values, double sigma_frames);

/// Factor by which GaussianFilter reduces the standard deviation of white noise, in (0, 1].
double NoiseAfterSmoothing(double sigma_frames);

/// Least-squares slope over `reach` frames to either side (fewer at the ends), per frame (3 x T).
/// `value(t, u)` is frame u relative to frame t, as a vector; rotations cannot be subtracted
/// otherwise.
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

/// Factor of SlopesOverTime on the standard deviation of white noise, per frame.
double NoiseOfSlope(Eigen::Index reach);

/// Standard deviation per axis of zero-mean frame-to-frame noise, from the median of second
/// differences, which are insensitive to steady motion. 0 for fewer than five frames.
double WhiteNoise(const Eigen::Matrix3Xd& positions);

}  // namespace holdfast
