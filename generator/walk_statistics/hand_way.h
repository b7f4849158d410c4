// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "geometry/body/skeleton.h"

namespace holdfast {

/// Returns the wrist position relative to the pelvis, in its heading frame, per frame: (3 x T)
/// meters. `placed`: placements of `frames`.
Eigen::Matrix3Xd HandPath(std::span<const BodyFrame> frames, std::span<const BodyPlacement> placed,
                          Side side);

/// Kinematics of a hand movement to its farthest point from the start (a mouth, a goal). The
/// arrival is the first frame at 95 % of the farthest distance. The onset is the last frame before
/// the peak speed (up to arrival) with less than a tenth of that speed, which excludes earlier
/// movements, such as taking a cup first. All NaN, without profile, for a hand that moves less than
/// 5 cm away.
struct HandWay {
  int begin = 0, arrival = 0;  ///< frames
  double length_m = 0;         ///< straight distance from onset to arrival
  double seconds = 0;
  double peak_m_s = 0;            ///< peak speed
  double time_to_peak_ratio = 0;  ///< of `seconds`; 0.56 for minimum jerk (Flash and Hogan 1985)
  double straightness_ratio = 0;  ///< length over path length: 1 for a straight line
  /// Number of speed rises, each before a fall, by a tenth of the peak or more: 1 for minimum jerk.
  double submovements = 0;
  Eigen::VectorXd profile;  ///< speed at equal fractions of the time, over the peak speed
};

/// `path`: (3 x T) meters, in the frame of the body of the hand; `rate` in Hz.
HandWay MeasureHandWay(const Eigen::Matrix3Xd& path, double rate, int profile_points);

}  // namespace holdfast
