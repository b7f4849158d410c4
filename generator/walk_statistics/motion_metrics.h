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

/// Mean and maximum over the 22 body joints and all frames where the difference is defined.
struct MeanAndMax {
  double mean = 0.0;
  double max = 0.0;
};

struct MotionMetrics {
  /// Central differences of positions; the first and last frames are excluded.
  MeanAndMax joint_speed_m_s;
  MeanAndMax joint_acceleration_m_s2;
  MeanAndMax joint_jerk_m_s3;
  /// Mean over frames and both feet of v (2 - 2^(h / 25 mm)) where h < 25 mm. v is the horizontal
  /// displacement of the ball of the foot per frame, h its height above its lowest position in the
  /// clip (Zhang, Starke, Komura & Saito 2018).
  double foot_skate_mm_per_frame = 0.0;
  /// Maximum horizontal displacement of a ball of the foot between two frames with h < 5 mm.
  double foot_slide_max_mm_per_frame = 0.0;
  /// Fraction of frames and feet with h < 25 mm.
  double foot_contact_ratio = 0.0;
};

/// Throws Error if there are no frames or the frame rate is not positive. A difference for which
/// the clip is too short is zero.
MotionMetrics MeasureMotion(std::span<const JointPositions> frames, double frame_rate_hz);

}  // namespace holdfast
