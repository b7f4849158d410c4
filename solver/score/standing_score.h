// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <vector>

#include "generator/walk_statistics/motion_metrics.h"
#include "geometry/clip/clip.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

/// How a person stands, looks and ends, from joint positions. The free wrist is that of the hand
/// that holds the object in fewer frames; without a difference, the one that moves less.
struct StandingScore {
  double pelvis_range_m = 0.0;      ///< largest horizontal distance of two pelvis positions
  double free_wrist_range_m = 0.0;  ///< largest distance of two positions of the free wrist
  /// Mean angle between the direction of the face and the way from the eyes to the object's center
  /// (without an object: to the other wrist), over the frames in which it is more than 0.3 m from
  /// the eyes. None if there are no such frames.
  std::optional<double> gaze_off_rad;
  double head_range_rad = 0.0;       ///< largest angle between two directions of the face
  double lean_start_rad = 0.0;       ///< of the way from pelvis to neck, forwards, first frame
  double head_down_start_rad = 0.0;  ///< of the face below the horizontal, first frame
  double end_speed_m_s = 0.0;        ///< of the fastest body joint over the last 0.2 s
};

/// `joints`: of every frame of `clip`. `object`: mesh of the clip's object, or null.
StandingScore MeasureStanding(const Clip& clip, const std::vector<JointPositions>& joints,
                              const Eigen::Matrix3Xd& rest_joints, const TriangleMesh* object);

/// Angle between the opening of a vessel and the vertical, radians: in the first frame and the
/// maximum over all frames. None for an object without an opening (FindOpening).
struct VesselTilt {
  double start_rad = 0.0, max_rad = 0.0;
};
std::optional<VesselTilt> MeasureVesselTilt(const Clip& clip, const TriangleMesh& object);

}  // namespace holdfast
