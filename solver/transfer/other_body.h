// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/clip/clip.h"
#include "geometry/clip/clip_body.h"

namespace holdfast {

/// Report of a retargeting to another body.
struct OtherBodyReport {
  double leg_ratio = 1.0;       ///< leg length of the new body relative to the old one's
  double height_ratio = 1.0;    ///< the same of the head's height in the rest pose
  double ankle_missed_m = 0.0;  ///< maximum distance of a foot from its target
  double sink_m = 0.0;          ///< maximum lowering of the pelvis for both legs to reach
  double fingers_ratio = 1.0;   ///< ratio of hand lengths
};

/// A retargeted clip and its report.
struct OntoBody {
  Clip clip;
  OtherBodyReport report;
};

/// Retargets a motion to another body: feet keep their positions (the soles at their heights), the
/// pelvis stays above the same point with its height scaled by the leg length, legs are solved by
/// inverse kinematics; trunk, arms and fingers keep their rotations. The object track is unchanged.
/// A single hand keeps its wrist position. Models may differ: joint rotations are compatible.
/// Throws Error for a hand alone with a whole body.
OntoBody OntoOtherBody(const Clip& clip, const ClipBody& from, const ClipBody& to);

/// Target wrist poses (world) in frames [begin, end).
struct WristPath {
  Side side = Side::kRight;
  int begin = 0, end = 0;
  std::vector<Eigen::Isometry3d> wrist;  ///< end - begin
};

/// Report of BringWrists.
struct ArmReport {
  double shortfall_m = 0.0;  ///< maximum distance of a wrist from its path: the arm is too short
  double step_m = 0.0;       ///< displacement of the person for the arms to reach
  double wrist_moved_mean_m = 0.0, wrist_moved_max_m = 0.0;  ///< from the clip's, on the paths
};

/// Moves the wrists of a clip onto their paths (MoveWrist) and blends back to the clip within
/// `blend_s` before and after. If an arm is too short in some frame, the whole clip is shifted
/// horizontally towards the path (at most 0.4 m).
ArmReport BringWrists(const ClipBody& body, const std::vector<WristPath>& paths, double blend_s,
                      Clip& clip);

}  // namespace holdfast
