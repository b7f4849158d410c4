// SPDX-License-Identifier: MIT
#pragma once

#include <array>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/hand_model.h"
#include "geometry/body/skeleton.h"

namespace holdfast {

/// Builds a pose joint by joint from the root outwards, with rotations relative to the parent or in
/// the world. Joint poses can be read at any time.
class PoseBuilder {
 public:
  /// `rest_joints` (3 x 55) must outlive the builder. Starts in the rest pose at `pelvis` (world).
  PoseBuilder(const Eigen::Matrix3Xd& rest_joints, const Eigen::Vector3d& pelvis)
      : rest_joints_(rest_joints), pelvis_(pelvis) {
    local_.fill(Eigen::Matrix3d::Identity());
  }

  void SetPelvis(const Eigen::Vector3d& pelvis) { pelvis_ = pelvis; }
  void SetLocal(int joint, const Eigen::Matrix3d& rotation) { local_[joint] = rotation; }
  /// Sets the world rotation of a joint, given the current rotations of its parents.
  void SetWorld(int joint, const Eigen::Matrix3d& rotation) {
    local_[joint] =
        joint == 0 ? rotation : Eigen::Matrix3d(World(kJointParents[joint]).transpose() * rotation);
  }

  void SetFingers(Side side, const FingerPose& fingers);

  Eigen::Matrix3d World(int joint) const;
  Eigen::Vector3d Position(int joint) const;

  /// Axis-angle rotations, each the equivalent nearest to `previous`, so that clips have no jumps.
  JointPose Pose(const JointPose& previous) const;
  /// Root translation of a clip frame: joints are G_j + trans.
  Eigen::Vector3d Trans() const { return pelvis_ - rest_joints_.col(0); }

 private:
  const Eigen::Matrix3Xd& rest_joints_;
  Eigen::Vector3d pelvis_;
  std::array<Eigen::Matrix3d, kNumJoints> local_;
};

/// Moves a wrist to a nearby world pose by changing shoulder, elbow and wrist joint only, and as
/// little as possible: the elbow bends about its present axis until the distance fits, the arm
/// rotates about the shoulder by the smallest rotation that brings the wrist to its place, and the
/// wrist joint takes the rest of the rotation. Exact if the target is in reach; otherwise the wrist
/// comes as near as the arm length allows, with the target rotation.
///
/// `rest_joints` (3 x 55); `pose` and `trans` as in a clip. Returns the remaining distance, meters.
double MoveWrist(const Eigen::Matrix3Xd& rest_joints, Side side, const Eigen::Matrix3d& rotation,
                 const Eigen::Vector3d& position, const Eigen::Vector3d& trans, JointPose& pose);

/// Returns the hand pose of a hanging arm: fingers slightly curled, more towards the little finger.
FingerPose RelaxedFingers(const Eigen::Matrix3Xd& rest_joints, Side side);

/// Returns a grasping hand pose: `closure` 0 is open and spread, ready to receive; 1 is closed
/// around a handle of a few centimeters with the thumb opposed. In between, the fingers close
/// together. Flexes each finger about its own axis, derived from the bones of `rest_joints` (3 x
/// 55), within the range of a hand.
FingerPose GraspingFingers(const Eigen::Matrix3Xd& rest_joints, Side side, double closure);

}  // namespace holdfast
