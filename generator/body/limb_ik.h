// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/body/skeleton.h"

namespace holdfast {

/// Two bones with a hinge between them: shoulder-elbow-wrist or hip-knee-ankle.
struct Limb {
  int root, middle, end;   ///< joints
  Eigen::Vector3d hinge;   ///< unit, rest frame: positive rotation about it flexes
  double min_flexion_rad;  ///< 0 is straight
  double max_flexion_rad;
};

Limb Arm(Side side);  ///< flexion 2..150 degrees
Limb Leg(Side side);  ///< flexion 1..150 degrees

struct LimbPose {
  Eigen::Matrix3d upper;  ///< world rotation of the root joint
  Eigen::Matrix3d lower;  ///< world rotation of the middle joint
  Eigen::Vector3d end;    ///< where the end joint lands, world
  double flexion_rad = 0.0;
  bool reached = false;  ///< `end` is the target; else the nearest point within the limits
};

/// The one pose that puts the limb's end on `target` with the middle joint on the side of `pole`
/// (a direction, world; need not be perpendicular or unit). Exact: law of cosines. A target too far
/// or too near is replaced by the point in its direction at the distance that the flexion limits
/// allow. `rest_joints` (3 x 55); `root` is the root joint's position, world meters.
LimbPose SolveLimb(const Eigen::Matrix3Xd& rest_joints, const Limb& limb,
                   const Eigen::Vector3d& root, const Eigen::Vector3d& target,
                   const Eigen::Vector3d& pole);

/// Shortest and longest distance from root to end that the flexion limits allow, meters.
double MinReach(const Eigen::Matrix3Xd& rest_joints, const Limb& limb);
double MaxReach(const Eigen::Matrix3Xd& rest_joints, const Limb& limb);

/// What a wrist and forearm can do, radians (active range of a healthy adult).
struct WristLimits {
  double flexion_max = 1.31, flexion_min = -1.22;  ///< towards the palm, towards the back
  double ulnar_max = 0.61, ulnar_min = -0.35;      ///< towards the little finger, the thumb
  double twist_max = 1.48;                         ///< pronation and supination from the rest pose
};

struct WristPose {
  Eigen::Matrix3d lower;  ///< world rotation of the elbow joint with its share of the twist
  Eigen::Matrix3d wrist;  ///< rotation of the wrist relative to that
  double flexion_rad = 0.0, ulnar_rad = 0.0, twist_rad = 0.0;
  bool reached = false;  ///< the hand has the orientation asked for
};

/// Brings the hand to a world orientation: the twist about the forearm is shared half and half by
/// elbow and wrist joint (skin then twists along the whole forearm), the rest bends the wrist.
/// Clamped to the limits. The wrist's position stays.
WristPose SolveWrist(const Eigen::Matrix3Xd& rest_joints, Side side, const Eigen::Matrix3d& lower,
                     const Eigen::Matrix3d& hand, const WristLimits& limits = {});

/// World rotation of a wrist joint whose fingers point along `fingers` and whose thumb side faces
/// `thumb` (made perpendicular to it). Throws Error when the two are parallel.
Eigen::Matrix3d HandOrientation(Side side, const Eigen::Vector3d& fingers,
                                const Eigen::Vector3d& thumb);

/// The unit vector out of the palm for a wrist's world rotation.
inline Eigen::Vector3d PalmDirection(const Eigen::Matrix3d& hand) { return -hand.col(1); }
/// The unit vector along the fingers for a wrist's world rotation.
inline Eigen::Vector3d FingerDirection(Side side, const Eigen::Matrix3d& hand) {
  return side == Side::kRight ? Eigen::Vector3d(-hand.col(0)) : Eigen::Vector3d(hand.col(0));
}

}  // namespace holdfast
