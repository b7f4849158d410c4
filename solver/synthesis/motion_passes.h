// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string_view>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "geometry/clip/clip.h"
#include "solver/actions/action_studio.h"

namespace holdfast {

/// The right arm as it is comfortable with the hand where it is (ArmIk::Track): networks lift
/// elbows to the shoulder. Nothing changes in the first frame, all of it is there when the hand has
/// gone farthest; `elbow_rad` is added to where elbows are then, up and out. A brush is turned
/// about its bristles until it comes to the mouth from the side, as the scripts have it. `clip`: of
/// a right-handed person, its object that of `prop`, which goes along with the hand.
void EaseArm(const ActionActor& actor, const ActionProp& prop, std::string_view action,
             double elbow_rad, Clip& clip);

/// Makes the right hand's way to where it goes (HandWay) one movement: it gets faster, is fastest
/// before half of the time, and slows down until it is there, as hands of captured people do.
/// Networks' hands get faster and slower two or three times, from key frame to key frame. Frames
/// are shown earlier or later, those of the whole body with the hand: where the hand goes, how long
/// it takes and the number of frames stay. At most six times as fast as they were, where the
/// hand halts. Leaves a clip as it is in which the hand has no way.
void RetimeHand(const Eigen::Matrix3Xd& rest_joints, Clip& clip);

/// Leaves out frames at the start in which nothing happens yet: networks are given four key frames
/// of somebody who stands still, and then wait as the scripts did. Of the frames in which the right
/// hand is within 2 cm of where it was and turned by less than 8 degrees, so many stay, evenly, as
/// make 0.3 s; the first is one of them. Leaves a clip as it is in which the hand never leaves.
/// Returns how many were left out.
int TrimIdle(const Eigen::Matrix3Xd& rest_joints, Clip& clip);

/// How a person does something, apart from what is done: people differ in it, and so do the
/// repetitions of one. Angles in radians, of the posture once the hand is where it goes.
struct SampleStyle {
  double pace = 1.0;               ///< multiplies durations
  Eigen::Vector3d trunk{0, 0, 0};  ///< axis-angle of the whole spine in the pelvis's frame: lean
                                   ///< forward, turn to the left, bend to the right
  double elbow = 0.0;  ///< of the arm that acts, about the line from shoulder to wrist: out
  Eigen::Vector3d other_arm{0, 0, 0};  ///< of the other upper arm, in the chest's frame
  double other_elbow = 0.0;            ///< bend of the other elbow, 0 or more; its forearm comes in
  /// Of the pelvis over the feet, to the left and forward, meters: onto one leg, whose hip rises.
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
