// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "geometry/body/skeleton.h"

namespace holdfast {

/// Where the wrist is in each frame as the pelvis and its heading have it: (3 x T) meters.
/// `placed`: the frames, placed.
Eigen::Matrix3Xd HandPath(std::span<const BodyFrame> frames, std::span<const BodyPlacement> placed,
                          Side side);

/// How a hand gets to where it is farthest from where it was: to the mouth, to a goal. It arrives
/// in the first frame with 95 % of the farthest distance made, and sets out in the last frame
/// before its greatest speed until then with less than a tenth of that speed: another movement
/// before it, to a cup that is taken first, is not of the way. All NaN, and no profile, for a hand
/// that gets less than 5 cm away.
struct HandWay {
  int begin = 0, arrival = 0;  ///< frames
  double length_m = 0;         ///< from where it sets out to where it arrives, straight
  double seconds = 0;
  double peak_m_s = 0;            ///< greatest speed
  double time_to_peak_ratio = 0;  ///< of `seconds`; 0.56 for minimum jerk (Flash and Hogan 1985)
  double straightness_ratio = 0;  ///< length over way made: 1 for a straight line
  /// Times that speed rises, then falls, by a tenth of its greatest or more: 1 for minimum jerk.
  double submovements = 0;
  Eigen::VectorXd profile;  ///< speed at equal shares of the time, over the greatest
};

/// `path`: (3 x T) meters, in the frame of the body that the hand belongs to; `rate` in Hz.
HandWay MeasureHandWay(const Eigen::Matrix3Xd& path, double rate, int profile_points);

}  // namespace holdfast
