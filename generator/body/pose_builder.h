// SPDX-License-Identifier: MIT
#pragma once

#include <array>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/skeleton.h"

namespace holdfast {

/// A pose under construction, joint by joint from the root outwards, in whichever frame is handy:
/// relative to the parent or in the world. Reads back where joints are at any time.
class PoseBuilder {
 public:
  /// `rest_joints` (3 x 55) must outlive the builder. Starts in the rest pose at `pelvis` (world).
  PoseBuilder(const Eigen::Matrix3Xd& rest_joints, const Eigen::Vector3d& pelvis)
      : rest_joints_(rest_joints), pelvis_(pelvis) {
    local_.fill(Eigen::Matrix3d::Identity());
  }

  void SetPelvis(const Eigen::Vector3d& pelvis) { pelvis_ = pelvis; }
  void SetLocal(int joint, const Eigen::Matrix3d& rotation) { local_[joint] = rotation; }
  /// Turns the joint so that its frame has this world rotation, given its parents as they are now.
  void SetWorld(int joint, const Eigen::Matrix3d& rotation) {
    local_[joint] =
        joint == 0 ? rotation : Eigen::Matrix3d(World(kJointParents[joint]).transpose() * rotation);
  }

  Eigen::Matrix3d World(int joint) const;
  Eigen::Vector3d Position(int joint) const;

  /// Axis-angles, each the nearest equivalent to `previous`, so that clips have no jumps.
  JointPose Pose(const JointPose& previous) const;
  /// Root translation of a clip's frame: joints are G_j + trans.
  Eigen::Vector3d Trans() const { return pelvis_ - rest_joints_.col(0); }

 private:
  const Eigen::Matrix3Xd& rest_joints_;
  Eigen::Vector3d pelvis_;
  std::array<Eigen::Matrix3d, kNumJoints> local_;
};

/// Moves a wrist to a world pose near the one it has, changing shoulder, elbow and wrist joint
/// only, and those by little: the elbow bends about the axis it is bent about until the distance
/// fits, the whole arm swings about the shoulder by the least rotation that brings the wrist there,
/// and the wrist joint takes what is left of the rotation. Exact when the target is in reach;
/// otherwise the wrist comes as near as the arm is long, with the rotation asked for.
///
/// `rest_joints` (3 x 55); `pose` and `trans` as in a clip. Returns the distance that is missing,
/// meters.
double MoveWrist(const Eigen::Matrix3Xd& rest_joints, Side side, const Eigen::Matrix3d& rotation,
                 const Eigen::Vector3d& position, const Eigen::Vector3d& trans, JointPose& pose);

}  // namespace holdfast
