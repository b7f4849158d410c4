// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/body/skeleton.h"

namespace holdfast {

/// Two bones joined by a hinge: shoulder-elbow-wrist or hip-knee-ankle.
struct Limb {
  int root, middle, end;   ///< joints
  Eigen::Vector3d hinge;   ///< unit, rest frame; a positive rotation flexes
  double min_flexion_rad;  ///< 0 is straight
  double max_flexion_rad;
};

Limb Arm(Side side);  ///< flexion 2..150 degrees
Limb Leg(Side side);  ///< flexion 1..150 degrees

struct LimbPose {
  Eigen::Matrix3d upper;  ///< world rotation of the root joint
  Eigen::Matrix3d lower;  ///< world rotation of the middle joint
  Eigen::Vector3d end;    ///< position of the end joint, world
  double flexion_rad = 0.0;
  bool reached = false;  ///< `end` is the target; otherwise the nearest point within the limits
};

/// Closed-form two-bone IK (law of cosines): puts the end of the limb on `target`, with the middle
/// joint on the side of `pole` (a world direction; need not be perpendicular or unit). A target
/// that is too far or too near is replaced by the point in its direction at the distance allowed by
/// the flexion limits. `rest_joints` (3 x 55); `root` is the root joint position, world meters.
LimbPose SolveLimb(const Eigen::Matrix3Xd& rest_joints, const Limb& limb,
                   const Eigen::Vector3d& root, const Eigen::Vector3d& target,
                   const Eigen::Vector3d& pole);

/// Minimum and maximum distance from root to end within the flexion limits, meters.
double MinReach(const Eigen::Matrix3Xd& rest_joints, const Limb& limb);
double MaxReach(const Eigen::Matrix3Xd& rest_joints, const Limb& limb);

/// Range of motion of wrist and forearm, radians (active range of a healthy adult).
struct WristLimits {
  double flexion_max = 1.31, flexion_min = -1.22;  ///< towards the palm, towards the back
  double ulnar_max = 0.61, ulnar_min = -0.35;      ///< towards the little finger, towards the thumb
  double twist_max = 1.48;                         ///< pronation and supination from the rest pose
};

struct WristPose {
  Eigen::Matrix3d lower;  ///< world rotation of the elbow joint with its half of the twist
  Eigen::Matrix3d wrist;  ///< rotation of the wrist relative to `lower`
  double flexion_rad = 0.0, ulnar_rad = 0.0, twist_rad = 0.0;
  bool reached = false;  ///< the hand has the target orientation
};

/// Rotates the hand to a world orientation. The twist about the forearm is split equally between
/// elbow and wrist joint, so that the skin twists along the whole forearm; the wrist bends for the
/// rest. Clamped to the limits. The wrist position does not change.
WristPose SolveWrist(const Eigen::Matrix3Xd& rest_joints, Side side, const Eigen::Matrix3d& lower,
                     const Eigen::Matrix3d& hand, const WristLimits& limits = {});

/// Returns the world rotation of a wrist joint whose fingers point along `fingers` and whose thumb
/// side faces `thumb` (orthogonalized). Throws Error if the two directions are parallel.
Eigen::Matrix3d HandOrientation(Side side, const Eigen::Vector3d& fingers,
                                const Eigen::Vector3d& thumb);

/// Returns the unit vector out of the palm for a world rotation of the wrist.
inline Eigen::Vector3d PalmDirection(const Eigen::Matrix3d& hand) { return -hand.col(1); }
/// Returns the unit vector along the fingers for a world rotation of the wrist.
inline Eigen::Vector3d FingerDirection(Side side, const Eigen::Matrix3d& hand) {
  return side == Side::kRight ? Eigen::Vector3d(-hand.col(0)) : Eigen::Vector3d(hand.col(0));
}

}  // namespace holdfast
