// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "geometry/io/motion/motion_file.h"
#include "geometry/retarget/retarget.h"
#include "geometry/retarget/skeleton_map.h"

namespace holdfast {

/// Turns a world with this axis up into one with y up, the shortest way; -y about x.
Eigen::Matrix3d UprightFrom(UpAxis up);

/// A source motion seen through a map: joints by SMPL-X number, world y-up.
class MappedMotion {
 public:
  MappedMotion(const SourceMotion& motion, const SkeletonMap& map, UpAxis up);

  int NumFrames() const { return motion_.NumFrames(); }
  bool Has(int joint) const { return map_.source[joint] >= 0; }
  Eigen::Vector3d Position(int frame, int joint) const {
    return upright_ * motion_.positions[frame].col(map_.source[joint]);
  }
  /// World rotation of the source joint that turns what SMPL-X's `joint` turns.
  Eigen::Matrix3d Rotation(int frame, int joint) const {
    return upright_ * motion_.Rotation(frame, turner_[joint]).toRotationMatrix();
  }
  /// Position with all source rotations zero (in the file's axes).
  Eigen::Vector3d Rest(int joint) const { return rest_.col(map_.source[joint]); }
  /// From the joint to the next one of the source (or the end site), in the frame of Rotation; zero
  /// where nothing hangs on it.
  Eigen::Vector3d Tip(int joint) const { return tip_[joint]; }
  /// From one joint to another in the frame of Rotation(from): mean over the clip. Rest offsets do
  /// not tell it where channels of position stand in for them.
  Eigen::Vector3d LocalBone(int from, int to) const;
  /// Every joint between the mapped joint and its nearest mapped ancestor is mapped too.
  bool HangsDirectly(int joint) const;
  const SkeletonMap& Map() const { return map_; }
  double FrameRate() const { return motion_.frame_rate; }

 private:
  const SourceMotion& motion_;
  const SkeletonMap& map_;
  Eigen::Matrix3d upright_;
  Eigen::Matrix3Xd rest_;
  std::array<int, kNumJoints> turner_;
  std::array<Eigen::Vector3d, kNumJoints> tip_;
};

/// What stays constant between a source skeleton and SMPL-X's.
struct RetargetCalibration {
  bool same_skeleton = false;
  /// All joints of the body are there and what hangs on each lies as in SMPL-X, bone lengths within
  /// 15 %: then every bone of the trunk points where the source's does.
  bool shaped_like_smplx = false;
  bool torso_rests_upright = false;  ///< spine, neck, head and collars are neutral in the rest pose
  bool neck_rests_with_head = true;  ///< the neck's rotation means something; else it is between
  double scale = 1;
  /// Left and right shoulder from spine3 in a neutral pose, SMPL-X axes, meters of the source; only
  /// where the torso rests upright.
  std::array<Eigen::Vector3d, 2> shoulder_at_rest{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  /// C_j: x_source = C_j x_smplx for the segment of joint j; its world rotation is Rotation(t, j)
  /// C_j.
  std::array<Eigen::Matrix3d, kNumJoints> source_from_smplx;
};

RetargetCalibration Calibrate(const MappedMotion& motion, const RetargetBody& body);

/// The least rotation that takes direction `from` to direction `to`.
Eigen::Matrix3d LeastRotation(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

/// Axis of the hinge of a knee or an elbow in SMPL-X's rest pose: bending is a positive turn about
/// it. `joint` is the knee or elbow.
Eigen::Vector3d HingeAxis(int joint);

/// `above` (world rotation of a thigh or an upper arm) bent about the hinge of `joint` (knee or
/// elbow) so that the rest bone points along `direction`; what the hinge cannot reach is made up by
/// the least turn. Steady for limbs folded flat, where the least turn alone may flip.
Eigen::Matrix3d BendHinge(int joint, const Eigen::Matrix3d& above, const Eigen::Vector3d& rest_bone,
                          const Eigen::Vector3d& direction);

/// Angle of the part of a rotation that turns about `axis` (unit), radians in (-pi, pi].
double TwistAngle(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& axis);

}  // namespace holdfast
