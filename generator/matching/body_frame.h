// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/skeleton.h"
#include "geometry/clip/clip.h"
#include "geometry/rotation.h"

namespace holdfast {

/// Pose of the 22 body joints in one frame: pelvis position and local rotations.
struct BodyFrame {
  Eigen::Vector3d pelvis = Eigen::Vector3d::Zero();  ///< position of joint 0, world meters
  /// Rotation of each joint relative to its parent; for the pelvis, relative to the world.
  std::array<Eigen::Quaterniond, kNumBodyJoints> local;

  BodyFrame() { local.fill(Eigen::Quaterniond::Identity()); }
};

/// World poses of the 22 body joints in one frame (forward kinematics).
struct BodyPlacement {
  std::array<Eigen::Matrix3d, kNumBodyJoints> rotation;  ///< world
  Eigen::Matrix<double, 3, kNumBodyJoints> joints;       ///< world, meters

  Eigen::Isometry3d WorldFromJoint(int joint) const {
    return RigidTransform(rotation[joint], joints.col(joint));
  }
};

BodyPlacement Place(const Eigen::Matrix3Xd& rest_joints, const BodyFrame& frame);

/// Same, for every frame of a motion.
std::vector<BodyPlacement> Place(const Eigen::Matrix3Xd& rest_joints,
                                 std::span<const BodyFrame> frames);

/// Rigid motion on the ground: a rotation about the vertical axis, then a horizontal translation.
struct PlanarMove {
  double yaw_rad = 0.0;
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();

  Eigen::Vector2d operator*(const Eigen::Vector2d& point) const {
    return Eigen::Rotation2Dd(yaw_rad) * point + shift;
  }
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const;
  BodyFrame operator*(const BodyFrame& frame) const;
};

/// Returns the yaw of the root about the vertical axis, from R = Rz(yaw) Ry Rx, in radians. A
/// standing body faces -y of its heading frame, which is the world frame rotated by this yaw.
double Yaw(const BodyFrame& frame);

/// Returns the move from the position and heading of `from` to those of `to`; heights are kept.
PlanarMove AlignHeading(const BodyFrame& from, const BodyFrame& to);

/// Interpolates by slerp, the pelvis linearly, from `from` (`share` = 0) to `to` (1).
BodyFrame Interpolate(const BodyFrame& from, const BodyFrame& to, double share);

/// Returns joints 0..21 of all frames of a clip. Fingers and face are dropped.
std::vector<BodyFrame> BodyFrames(const Clip& clip, const Eigen::Matrix3Xd& rest_joints);

/// Writes bodies back to their clip (BodyFrames): joints 0..21 and trans, rotations unwrapped
/// towards the clip's previous values.
void SetBodyFrames(const std::vector<BodyFrame>& frames, const Eigen::Matrix3Xd& rest_joints,
                   Clip& clip);

/// Converts frames to a clip, rotations unwrapped over time, `hands` (joints 25..54) constant.
Clip ToClip(const std::vector<BodyFrame>& frames, double frame_rate,
            const Eigen::Matrix3Xd& rest_joints, const JointPose& hands);

/// Mirrors a frame at the plane x = 0.
BodyFrame Mirror(const BodyFrame& frame);

}  // namespace holdfast
