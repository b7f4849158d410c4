// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "geometry/io/motion/motion_file.h"
#include "geometry/retarget/retarget.h"
#include "geometry/retarget/skeleton_map.h"

namespace holdfast {

/// Returns the shortest rotation from a world with this up axis to y up; -y is rotated about x.
Eigen::Matrix3d UprightFrom(UpAxis up);

/// A source motion in terms of a map: joints by SMPL-X number, world y-up.
class MappedMotion {
 public:
  MappedMotion(const SourceMotion& motion, const SkeletonMap& map, UpAxis up);

  int NumFrames() const { return motion_.NumFrames(); }
  bool Has(int joint) const { return map_.source[joint] >= 0; }
  Eigen::Vector3d Position(int frame, int joint) const {
    return upright_ * motion_.positions[frame].col(map_.source[joint]);
  }
  /// World rotation of the source joint that corresponds to SMPL-X's `joint`.
  Eigen::Matrix3d Rotation(int frame, int joint) const {
    return upright_ * motion_.Rotation(frame, turner_[joint]).toRotationMatrix();
  }
  /// Position with all source rotations zero (in the file's axes).
  Eigen::Vector3d Rest(int joint) const { return rest_.col(map_.source[joint]); }
  /// Vector from the joint to the source's next joint (or end site), in the frame of Rotation; zero
  /// if the joint has no child.
  Eigen::Vector3d Tip(int joint) const { return tip_[joint]; }
  /// Vector between two joints in the frame of Rotation(from), mean over the clip. Rest offsets do
  /// not give it in files that use position channels in their place.
  Eigen::Vector3d LocalBone(int from, int to) const;
  /// Whether every joint between the mapped joint and its nearest mapped ancestor is mapped too.
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

/// Constant data that relates a source skeleton to SMPL-X's.
struct RetargetCalibration {
  bool same_skeleton = false;
  /// All body joints are present, with children placed as in SMPL-X and bone lengths within 15 %:
  /// every trunk bone can then have the source's direction.
  bool shaped_like_smplx = false;
  bool torso_rests_upright = false;  ///< spine, neck, head and collars are neutral in the rest pose
  bool neck_rests_with_head = true;  ///< the neck's rotation is meaningful; otherwise interpolated
  double scale = 1;
  /// Left and right shoulder from spine3 in a neutral pose, SMPL-X axes, meters of the source; only
  /// if the torso rests upright.
  std::array<Eigen::Vector3d, 2> shoulder_at_rest{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  /// C_j: x_source = C_j x_smplx for the segment of joint j; its world rotation is Rotation(t, j)
  /// C_j.
  std::array<Eigen::Matrix3d, kNumJoints> source_from_smplx;
};

RetargetCalibration Calibrate(const MappedMotion& motion, const RetargetBody& body);

/// Returns the smallest rotation that takes direction `from` to direction `to`.
Eigen::Matrix3d LeastRotation(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

/// Hinge axis of a knee or an elbow (`joint`) in SMPL-X's rest pose: bending is a positive rotation
/// about it.
Eigen::Vector3d HingeAxis(int joint);

/// Bends `above` (world rotation of a thigh or an upper arm) about the hinge of `joint` (knee or
/// elbow) so that the rest bone points along `direction`. The remainder beyond the hinge is the
/// smallest rotation. Stable for fully folded limbs, where the smallest rotation alone may flip.
Eigen::Matrix3d BendHinge(int joint, const Eigen::Matrix3d& above, const Eigen::Vector3d& rest_bone,
                          const Eigen::Vector3d& direction);

/// Angle of the twist of a rotation about `axis` (unit), radians in (-pi, pi].
double TwistAngle(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& axis);

}  // namespace holdfast
