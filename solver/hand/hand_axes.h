// SPDX-License-Identifier: MIT
#pragma once

#include <array>

#include <Eigen/Core>

#include "geometry/body/hand_model.h"

namespace holdfast {

inline constexpr int kNumFingers = 5;
/// Finger k owns joints 3k, 3k + 1, 3k + 2 (file order).
enum Finger : int { kIndex = 0, kMiddle = 1, kPinky = 2, kRing = 3, kThumb = 4 };
inline constexpr std::array<const char*, kNumFingers> kFingerNames = {"index", "middle", "pinky",
                                                                      "ring", "thumb"};

/// Joint angles in anatomical terms, radians, one column per finger joint (file order). Rows:
///   0 flexion  + curls towards the palm (the thumb: across it); 0 is the model's rest pose
///   1 spread   + towards the thumb's side (the thumb: away from the palm, abduction)
///   2 twist    about the bone
using HandAngles = Eigen::Matrix<double, 3, kJointsPerHand>;

struct AngleRange {
  double low = 0.0, high = 0.0;  ///< radians
};

/// The axes a hand bends about, from the bones of its rest pose: the same code for both sides and
/// for every model of SMPL-X's layout. Directions are in the rest frame, which is the wrist's frame
/// (and that of every finger joint: SMPL-X joints share their axes in the rest pose).
///
/// An axis-angle is the sum of the angles times their axes, so that angles are a rotation of the
/// axis-angle's three numbers: exact both ways, and linear for solvers.
class HandAxes {
 public:
  explicit HandAxes(const HandModel& hand);

  Side HandSide() const { return side_; }

  /// Unit directions of the hand: from the wrist to the middle finger, towards the thumb's side,
  /// and out of the palm. Orthogonal.
  const Eigen::Vector3d& Forward() const { return forward_; }
  const Eigen::Vector3d& Across() const { return across_; }
  const Eigen::Vector3d& PalmNormal() const { return palm_normal_; }

  /// Finger joints and tips relative to the wrist in the rest pose, meters.
  const Eigen::Matrix<double, 3, kJointsPerHand>& RestJoints() const { return rest_joints_; }
  const Eigen::Matrix<double, 3, kNumFingers>& RestTips() const { return rest_tips_; }
  /// Unit direction of the bone that joint k moves.
  Eigen::Vector3d Bone(int finger_joint) const;
  /// Where the touching side of that bone faces, unit, orthogonal to the bone.
  Eigen::Vector3d PadDirection(int finger_joint) const { return pad_direction_.col(finger_joint); }

  /// Columns: the unit axes of flexion, spread and twist of a joint. Orthonormal.
  const Eigen::Matrix3d& Axes(int finger_joint) const { return axes_[finger_joint]; }

  FingerPose PoseOf(const HandAngles& angles) const;
  HandAngles AnglesOf(const FingerPose& pose) const;

  /// What a healthy adult reaches (Lin, Wu & Huang 2000, and the clinical literature), relative to
  /// the rest pose: a finger that rests bent has that much less to go.
  /// Rows as in HandAngles.
  const AngleRange& Range(int row, int finger_joint) const { return range_[row][finger_joint]; }
  HandAngles Clamp(const HandAngles& angles) const;
  /// Largest excess over the ranges, radians; 0 when all are respected.
  double LimitExcess(const HandAngles& angles) const;

  /// A hand hanging at ease: slightly curled, the thumb beside the index finger.
  HandAngles Relaxed() const;
  /// How far joint k is bent in the rest pose already, radians of flexion (0 for the thumb, whose
  /// ranges count from the rest pose).
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
