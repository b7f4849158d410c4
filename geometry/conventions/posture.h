// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/body_model.h"
#include "geometry/conventions/loose_motion.h"
#include "geometry/io/motion/motion_file.h"
#include "geometry/retarget/retarget.h"
#include "geometry/retarget/skeleton_map.h"

namespace holdfast {

/// Up axis of a motion's world, ground height, and unit of the root position, measured with a body
/// of average shape.
struct Posture {
  // Up.
  int axis = 2;               ///< 0 x, 1 y, 2 z
  int sign = 1;               ///< -1: downwards
  double head_over_feet = 0;  ///< median along that axis, meters
  double share = 0;           ///< fraction of frames in which that axis is nearest to head - feet
  bool up_is_certain = false;

  // Unit of `trans`.
  double meters_per_unit = 1.0;  ///< the one of m, cm, mm that puts the body onto the ground
  bool unit_is_certain = false;  ///< exactly one unit does

  // With that up axis and unit.
  double ground_m = 0;        ///< height of the ground
  double grounded_share = 0;  ///< fraction of frames with a foot within 3 cm of the ground
  double root_height_m = 0;   ///< median of the pelvis above the ground
  double fastest_root_m_per_s = 0;
};

Posture MeasurePosture(const LooseMotion& motion, const BodyModel& body);

/// Throws Error, with `source` as location, for a clip whose positions are certainly not in meters.
void RequireMeters(const std::string& source, const Clip& clip, const BodyModel& body);

/// "z" or "-y".
std::string AxisName(const Posture& posture);

/// Up axis of a motion on its own skeleton.
struct MotionUp {
  UpAxis axis = UpAxis::kY;
  double share = 0;      ///< fraction of frames in which head - feet is nearest to it
  bool certain = false;  ///< false: lies, crawls or bends too often; y by convention
};

MotionUp FindMotionUp(const SourceMotion& motion, const SkeletonMap& map);

/// Hip to knee to ankle, mean of both legs, meters.
double LegLength(const SourceMotion& motion, const SkeletonMap& map);

/// A frame with a discontinuity: it rotates or moves far more than in the surrounding steps.
struct Discontinuity {
  int frame = 0;  ///< between frame - 1 and this one
  std::string what;
  double size = 0;  ///< radians or meters
  bool turns = false;
};

/// Finds discontinuities of the root, the joints and the object; the first of each frame, by frame.
std::vector<Discontinuity> FindDiscontinuities(const LooseMotion& motion, double meters_per_unit);

/// A joint bent beyond its anatomical limit.
struct JointLimitViolation {
  int joint = 0;
  int frames = 0;  ///< number of frames
  int first_frame = 0;
  double worst_rad = 0;
  double limit_rad = 0;
};

/// Finds joints beyond a generous limit of their angle, the worst first.
std::vector<JointLimitViolation> FindOverbends(const LooseMotion& motion);

/// Fraction of the rotation of knees and elbows about their hinge axes (x and y in SMPL's order), 0
/// ... 1, over frames in which they are bent; negative if they never are.
double HingeAgreement(const LooseMotion& motion);

}  // namespace holdfast
