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

/// Which way a motion's world is up, how high its ground is, and in which unit its root moves, as
/// measured with a body of average shape.
struct Posture {
  // Up.
  int axis = 2;               ///< 0 x, 1 y, 2 z
  int sign = 1;               ///< -1: downwards
  double head_over_feet = 0;  ///< median along that axis, meters
  double share = 0;           ///< of the frames in which that axis is the nearest to head - feet
  bool up_is_certain = false;

  // Unit of `trans`.
  double meters_per_unit = 1.0;  ///< the one of m, cm, mm that puts the body onto the ground
  bool unit_is_certain = false;  ///< that one does, and no other

  // With that axis up and that unit.
  double ground_m = 0;        ///< height of the ground
  double grounded_share = 0;  ///< of the frames with a foot within 3 cm of the ground
  double root_height_m = 0;   ///< median of the pelvis over the ground
  double fastest_root_m_per_s = 0;
};

Posture MeasurePosture(const LooseMotion& motion, const BodyModel& body);

/// Throws Error, named `source`, for a clip whose positions are surely not meters.
void RequireMeters(const std::string& source, const Clip& clip, const BodyModel& body);

/// "z" or "-y".
std::string AxisName(const Posture& posture);

/// Which axis is up in a motion on a skeleton of its own.
struct MotionUp {
  UpAxis axis = UpAxis::kY;
  double share = 0;      ///< of the frames in which head - feet is nearest to that axis
  bool certain = false;  ///< false: the body lies, crawls or bends too often; y is the custom
};

MotionUp FindMotionUp(const SourceMotion& motion, const SkeletonMap& map);

/// Hip to knee to ankle, mean of both legs, meters.
double LegLength(const SourceMotion& motion, const SkeletonMap& map);

/// A frame in which something leaps: it turns or moves far more than in the steps around.
struct Discontinuity {
  int frame = 0;  ///< between frame - 1 and this one
  std::string what;
  double size = 0;  ///< radians or meters
  bool turns = false;
};

/// Leaps of the root, the joints and the object, the first of each frame, in order of frames.
std::vector<Discontinuity> FindDiscontinuities(const LooseMotion& motion, double meters_per_unit);

/// A joint bent as no healthy joint bends.
struct JointLimitViolation {
  int joint = 0;
  int frames = 0;  ///< how many
  int first_frame = 0;
  double worst_rad = 0;
  double limit_rad = 0;
};

/// Joints beyond a generous limit of their angle, the worst first.
std::vector<JointLimitViolation> FindOverbends(const LooseMotion& motion);

/// Knees and elbows are hinges: in SMPL's order they turn about x and y. Their share of the turning
/// about those, 0 ... 1, over frames in which they are bent; negative when they never are.
double HingeAgreement(const LooseMotion& motion);

}  // namespace holdfast
