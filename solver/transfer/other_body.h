// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/clip/clip.h"
#include "geometry/clip/clip_body.h"

namespace holdfast {

/// How a clip came onto another body.
struct OtherBodyReport {
  double leg_ratio = 1.0;       ///< of the new body's legs to the old one's
  double ankle_missed_m = 0.0;  ///< farthest that a foot stays from its place
  double sink_m = 0.0;          ///< most that the pelvis sinks so that both legs reach
  double fingers_ratio = 1.0;   ///< of the hands' lengths
};

/// The same motion of another body: feet are where they were (the soles at their heights), the
/// pelvis above the same place, higher or lower as the legs are longer or shorter, legs by inverse
/// kinematics; trunk, arms and fingers keep their rotations. The object's track stays as it is. A
/// hand alone has its wrist where it was. Models may differ: rotations of joints mean the same in
/// all. Throws Error for a hand alone and a whole body.
Clip OntoOtherBody(const Clip& clip, const ClipBody& from, const ClipBody& to,
                   OtherBodyReport* report = nullptr);

/// A clip on another body, and how it came there.
struct OntoBody {
  Clip clip;
  OtherBodyReport report;
};

/// Where a wrist is to be, of frames [begin, end): world poses.
struct WristPath {
  Side side = Side::kRight;
  int begin = 0, end = 0;
  std::vector<Eigen::Isometry3d> wrist;  ///< end - begin
};

/// How arms came to their paths.
struct ArmReport {
  double shortfall_m = 0.0;  ///< most that a wrist stays from its path: the arm is too short
  double step_m = 0.0;       ///< by which the person stands elsewhere so that arms reach
  double wrist_moved_mean_m = 0.0, wrist_moved_max_m = 0.0;  ///< from the clip's, on the paths
};

/// Brings the wrists of a clip onto their paths (MoveWrist) and, in the frames before and after,
/// smoothly back to the clip's own within `blend_s`. Where an arm is too short in some frame, the
/// person stands nearer, by one horizontal shift of the whole clip (at most 0.4 m).
ArmReport BringWrists(const ClipBody& body, const std::vector<WristPath>& paths, double blend_s,
                      Clip& clip);

}  // namespace holdfast
