// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/skeleton.h"
#include "geometry/clip/clip.h"

namespace holdfast {

/// Positions of all joints in one frame, world meters.
using JointPositions = Eigen::Matrix<double, 3, kNumJoints>;

/// Joint positions of every frame of a clip, for a body with these rest joints (3 x 55).
std::vector<JointPositions> JointTrajectory(const Clip& clip, const Eigen::Matrix3Xd& rest_joints);

/// Mean and greatest value over the 22 body joints and all frames where the difference exists.
struct MeanAndMax {
  double mean = 0.0;
  double max = 0.0;
};

struct MotionMetrics {
  /// Central differences of positions; forward-most and last frames are left out.
  MeanAndMax joint_speed_m_s;
  MeanAndMax joint_acceleration_m_s2;
  MeanAndMax joint_jerk_m_s3;
  /// Mean over frames and both feet of v (2 - 2^(h / 25 mm)), v the ball of the foot's horizontal
  /// way per frame and h its height above its lowest position in the clip, where h < 25 mm (Zhang,
  /// Starke, Komura & Saito 2018).
  double foot_skate_mm_per_frame = 0.0;
  /// Greatest horizontal way of a ball of the foot between frames while h < 5 mm in both.
  double foot_slide_max_mm_per_frame = 0.0;
  /// Share of frames and feet with h < 25 mm.
  double foot_contact_ratio = 0.0;
};

/// Throws Error for no frames or a frame rate that is not positive. Clips too short for a
/// difference have zero there.
MotionMetrics MeasureMotion(std::span<const JointPositions> frames, double frame_rate_hz);

}  // namespace holdfast
