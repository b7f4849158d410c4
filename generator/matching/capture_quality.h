// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "generator/matching/foot_lock.h"

namespace holdfast {

/// Quality of a captured or generated motion as training data, measured at 30 Hz.
struct MotionQuality {
  int frames = 0;
  /// Fraction of frames in which the lowest sole point moves over 2/3 cm along the ground until the
  /// next frame: the WANDR measure, on sole points (heels and balls) instead of vertices.
  double skate_ratio = 0.0;
  double lowest_sole_m = 0.0;      ///< 1st percentile over frames of the lowest sole point's height
  double still_sole_m = 0.0;       ///< 95th percentile of that height while the point stands still
  double airborne_ratio = 0.0;     ///< fraction of frames with all sole points above 10 cm
  double mean_acceleration = 0.0;  ///< mean over the 22 joints, m/s^2
  double p99_acceleration = 0.0;
  double max_acceleration = 0.0;
  double beyond_limits_ratio = 0.0;  ///< fraction of joint samples beyond the given joint limits
};

/// Maximum angle of each joint from its rest pose, radians.
using JointLimits = std::array<double, kNumBodyJoints>;

/// Histogram with bins of 0.1 m/s; the last bin is open.
using SpeedHistogram = std::array<long, 25>;
/// Histogram over all joints with bin edges 0, 1, 2, 4, 8, ... 128 m/s^2; the last bin is open.
using AccelerationHistogram = std::array<long, 9>;

/// Sums over many motions, for comparing sets of motions.
struct MotionStatistics {
  long frames = 0;
  double skating_frames = 0.0;
  SpeedHistogram pelvis_speed = {};
  AccelerationHistogram acceleration = {};

  void Add(const MotionStatistics& other);
};

MotionQuality MeasureQuality(const Eigen::Matrix3Xd& rest_joints, const SolePoints& soles,
                             std::span<const BodyFrame> frames, const JointLimits& limits,
                             MotionStatistics* statistics = nullptr);

/// Returns the 99.9th percentile of each joint's angle over all frames, but at least 17 degrees,
/// plus 3 degrees. The pelvis has no limit.
JointLimits LimitsOf(const std::vector<std::vector<BodyFrame>>& motions);

/// Returns LimitsOf the 415 captured clips that the embedded network was trained on (listed in its
/// model card), radians.
JointLimits CapturedJointLimits();
/// Limit of a collar's angle in reaches, radians. The shoulder has more range and does the rest.
inline constexpr double kCollarLimit = 0.314;

/// Returns a message that describes why a captured motion cannot be used, or an empty string.
std::string FaultOf(const MotionQuality& quality);

}  // namespace holdfast
