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

/// How sound a motion is as training data, captured or made; 30 Hz.
struct MotionQuality {
  int frames = 0;
  /// Share of frames in which the lowest of heels and balls moves more than 2/3 cm along the ground
  /// until the next (the measure of WANDR, on sole points instead of vertices).
  double skate_ratio = 0.0;
  double lowest_sole_m = 0.0;      ///< 1st percentile over frames of the lowest sole point's height
  double still_sole_m = 0.0;       ///< 95th percentile of that height where the point stands still
  double airborne_ratio = 0.0;     ///< share of frames with all soles above 10 cm
  double mean_acceleration = 0.0;  ///< of the 22 joints, m/s^2
  double p99_acceleration = 0.0;
  double max_acceleration = 0.0;
  double beyond_limits_ratio = 0.0;  ///< share of frames and joints beyond the joint limits given
};

/// Greatest angle of each joint from the rest pose, radians: what the limits are made of.
using JointLimits = std::array<double, kNumBodyJoints>;

/// Bins of 0.1 m/s, the last open.
using SpeedHistogram = std::array<long, 25>;
/// Bins [0, 1, 2, 4, 8, ... 128, more) m/s^2 of all joints.
using AccelerationHistogram = std::array<long, 9>;

/// Sums over many motions, to be compared side by side.
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

/// 99.9th percentile of each joint's angle over all frames, at least 17 degrees, plus 3; the pelvis
/// has none.
JointLimits LimitsOf(const std::vector<std::vector<BodyFrame>>& motions);

/// LimitsOf the 415 captured clips that the embedded network learned from (its model card says
/// which), radians.
JointLimits CapturedJointLimits();
/// Of a collar in a reach, radians: the shoulder has farther to go, and does the rest.
inline constexpr double kCollarLimit = 0.314;

/// What captured motion must keep to be used.
struct CaptureLimits {
  double skate_ratio = 0.6;
  double lowest_sole_m = -0.06;
  double still_sole_m = 0.10;  ///< higher: the ground is not level
  double airborne_ratio = 0.25;
  double max_acceleration = 250.0;
};

/// What is wrong with a motion, in words; empty when nothing is.
std::string FaultOf(const MotionQuality& quality, const CaptureLimits& limits);

}  // namespace holdfast
