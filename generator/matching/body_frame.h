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

/// One frame of a body's 22 joints in the form that motions are cut and joined in.
struct BodyFrame {
  Eigen::Vector3d pelvis = Eigen::Vector3d::Zero();  ///< position of joint 0, world meters
  /// Rotations relative to the parent; that of the pelvis relative to the world.
  std::array<Eigen::Quaterniond, kNumBodyJoints> local;

  BodyFrame() { local.fill(Eigen::Quaterniond::Identity()); }
};

/// Where the joints of a frame are.
struct BodyPlacement {
  std::array<Eigen::Matrix3d, kNumBodyJoints> rotation;  ///< world
  Eigen::Matrix<double, 3, kNumBodyJoints> joints;       ///< world, meters

  Eigen::Isometry3d WorldFromJoint(int joint) const {
    return RigidTransform(rotation[joint], joints.col(joint));
  }
};

BodyPlacement Place(const Eigen::Matrix3Xd& rest_joints, const BodyFrame& frame);

/// The same of every frame of a motion.
std::vector<BodyPlacement> Place(const Eigen::Matrix3Xd& rest_joints,
                                 std::span<const BodyFrame> frames);

/// A turn about the vertical axis, then a move along the ground.
struct PlanarMove {
  double yaw_rad = 0.0;
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();

  Eigen::Vector2d operator*(const Eigen::Vector2d& point) const {
    return Eigen::Rotation2Dd(yaw_rad) * point + shift;
  }
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const;
  BodyFrame operator*(const BodyFrame& frame) const;
};

/// The root's turn about the vertical axis: R = Rz(yaw) Ry Rx. A body that stands faces -y of the
/// frame turned by it (its heading frame).
double Yaw(const BodyFrame& frame);

/// The move that carries `from` to the place and heading of `to`; heights stay.
PlanarMove AlignHeading(const BodyFrame& from, const BodyFrame& to);

/// Shortest arcs and a straight line, `share` of the way.
BodyFrame Interpolate(const BodyFrame& from, const BodyFrame& to, double share);

/// Joints 0..21 of all frames of a clip; fingers and face are left behind.
std::vector<BodyFrame> BodyFrames(const Clip& clip, const Eigen::Matrix3Xd& rest_joints);

/// Frames as a clip, rotations unwrapped along time; `hands` (joints 25..54) the same throughout.
Clip ToClip(const std::vector<BodyFrame>& frames, double frame_rate,
            const Eigen::Matrix3Xd& rest_joints, const JointPose& hands);

/// The frame in a mirror at x = 0.
BodyFrame Mirror(const BodyFrame& frame);

}  // namespace holdfast
