// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "geometry/clip/clip.h"

namespace holdfast {

/// How a person does something, apart from what is done: people differ in it, and so do the
/// repetitions of one. Angles in radians, of the posture once the hand is where it goes.
struct SampleStyle {
  double pace = 1.0;               ///< multiplies durations
  Eigen::Vector3d trunk{0, 0, 0};  ///< axis-angle of the whole spine in the pelvis's frame: lean
                                   ///< forward, turn to the left, bend to the right
  double elbow = 0.0;  ///< of the arm that acts, about the line from shoulder to wrist: out
  Eigen::Vector3d other_arm{0, 0, 0};  ///< of the other upper arm, in the chest's frame
  double other_elbow = 0.0;            ///< bend of the other elbow, 0 or more; its forearm comes in
  /// Of the pelvis over the feet, to the left and forward, metres: onto one leg, whose hip rises.
  Eigen::Vector2d weight{0, 0};
};

/// Sample 0 of every seed has none. Pace varies by a quarter, the trunk by 5 to 10 degrees (little
/// backwards), the elbow by 20, the other arm by 14 with the elbow bent by up to 70, weight by 3
/// cm. `amount` multiplies all of it.
SampleStyle DrawSampleStyle(std::uint64_t seed, int sample, double amount);

/// Key frames of a right-handed person as somebody of that style does them: nothing changes in the
/// first frame, all of it is there when the right hand has gone farthest. The hand keeps its
/// rotation relative to the trunk, the object stays with the hand. Feet are left to what comes
/// after (MotionOfKeyFrames).
void ApplySampleStyle(const SampleStyle& style, const Eigen::Matrix3Xd& rest_joints, Clip& keys);

/// `share` of such a `weight`: the pelvis goes there and that hip rises, the trunk stays upright on
/// it.
void ShiftWeight(const Eigen::Vector2d& weight, double share, BodyFrame& frame);

}  // namespace holdfast
