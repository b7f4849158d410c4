// SPDX-License-Identifier: MIT
#pragma once

#include <array>

#include <Eigen/Core>

#include "geometry/body/hand_model.h"

namespace holdfast {

inline constexpr int kNumFingers = 5;
/// Finger k has joints 3k, 3k + 1, 3k + 2 (file order).
enum Finger : int { kIndex = 0, kMiddle = 1, kPinky = 2, kRing = 3, kThumb = 4 };
inline constexpr std::array<const char*, kNumFingers> kFingerNames = {"index", "middle", "pinky",
                                                                      "ring", "thumb"};

/// Anatomical joint angles, radians, one column per finger joint (file order). Rows:
///   0 flexion  + curls towards the palm (thumb: across it); 0 is the model's rest pose
///   1 spread   + towards the thumb's side (thumb: away from the palm, abduction)
///   2 twist    about the bone
using HandAngles = Eigen::Matrix<double, 3, kJointsPerHand>;

struct AngleRange {
  double low = 0.0, high = 0.0;  ///< radians
};

/// Joint with the largest skinning weight of a vertex.
int DominantJoint(const BodySurface& surface, int vertex);

/// Anatomical axes of a hand, from the bones of its rest pose: the same code for both sides and for
/// every model of SMPL-X's layout. Directions are in the rest frame, which is the wrist frame (and
/// that of every finger joint: SMPL-X joints share their axes in the rest pose).
///
/// An axis-angle is the sum of the angles times their axes. Hence the angles are a rotation of the
/// axis-angle's three entries: exact both ways, and linear for solvers.
class HandAxes {
 public:
  explicit HandAxes(const HandModel& hand);

  Side HandSide() const { return side_; }

  /// Orthogonal unit directions of the hand: from the wrist to the middle finger, towards the
  /// thumb's side, and out of the palm.
  const Eigen::Vector3d& Forward() const { return forward_; }
  const Eigen::Vector3d& Across() const { return across_; }
  const Eigen::Vector3d& PalmNormal() const { return palm_normal_; }

  /// Finger joints and tips relative to the wrist in the rest pose, meters.
  const Eigen::Matrix<double, 3, kJointsPerHand>& RestJoints() const { return rest_joints_; }
  const Eigen::Matrix<double, 3, kNumFingers>& RestTips() const { return rest_tips_; }
  /// Unit direction of the bone that joint k moves.
  Eigen::Vector3d Bone(int finger_joint) const;
  /// Direction of the touching side of that bone, unit, orthogonal to the bone.
  Eigen::Vector3d PadDirection(int finger_joint) const { return pad_direction_.col(finger_joint); }

  /// Unit axes of flexion, spread and twist of a joint as columns. Orthonormal.
  const Eigen::Matrix3d& Axes(int finger_joint) const { return axes_[finger_joint]; }

  FingerPose PoseOf(const HandAngles& angles) const;
  HandAngles AnglesOf(const FingerPose& pose) const;

  /// Range of motion of a healthy adult (Lin, Wu & Huang 2000, and the clinical literature),
  /// relative to the rest pose: the range of a finger that is bent at rest is reduced accordingly.
  /// Rows as in HandAngles.
  const AngleRange& Range(int row, int finger_joint) const { return range_[row][finger_joint]; }
  HandAngles Clamp(const HandAngles& angles) const;
  /// Maximum excess over the ranges, radians; 0 if all are respected.
  double LimitExcess(const HandAngles& angles) const;

  /// A relaxed hand: slightly curled, the thumb beside the index finger.
  HandAngles Relaxed() const;
  /// Flexion of joint k in the rest pose, radians (0 for the thumb, whose ranges are relative to
  /// the rest pose).
  double RestFlexion(int finger_joint) const { return rest_flexion_[finger_joint]; }

 private:
  Side side_;
  Eigen::Vector3d forward_, across_, palm_normal_;
  Eigen::Matrix<double, 3, kJointsPerHand> rest_joints_;
  Eigen::Matrix<double, 3, kNumFingers> rest_tips_;
  Eigen::Matrix<double, 3, kJointsPerHand> pad_direction_;
  std::array<Eigen::Matrix3d, kJointsPerHand> axes_;
  std::array<double, kJointsPerHand> rest_flexion_{};
  std::array<std::array<AngleRange, kJointsPerHand>, 3> range_;
};

}  // namespace holdfast
