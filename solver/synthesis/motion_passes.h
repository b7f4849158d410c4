// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "geometry/clip/clip.h"
#include "geometry/mesh/mesh.h"
#include "solver/actions/action_studio.h"

namespace holdfast {

/// Moves the right arm to a comfortable posture with the hand fixed (ArmIk::Track), because
/// networks raise elbows to the shoulder. The change is zero in the first frame and complete when
/// the hand is farthest away; `elbow_rad` is then added to the elbow swivel, up and out. A brush is
/// rotated about its bristles to approach the mouth from the side, as in the scripts. A vessel
/// whose action does not tilt it is brought within 15 degrees of upright, about its middle;
/// `opening`: the direction of its opening in the object's frame, none for other objects. `clip`:
/// of a right-handed person, with the object of `prop`, which moves with the hand.
void EaseArm(const ActionActor& actor, const ActionProp& prop,
             const std::optional<Eigen::Vector3d>& opening, std::string_view action,
             double elbow_rad, Clip& clip);

/// Retimes the reach of the right hand (HandWay) to a single movement: it accelerates, peaks before
/// half of the time, and decelerates until arrival, like captured hands. Networks accelerate and
/// decelerate two or three times, between key frames. Whole-body frames are shifted in time with
/// the hand; its path, duration and the number of frames are preserved. Where the hand halts, the
/// speedup is at most six. The clip is unchanged if the hand makes no reach.
void RetimeHand(const Eigen::Matrix3Xd& rest_joints, Clip& clip);

/// Removes idle frames at the start: networks receive four key frames of a person standing still,
/// and then wait as the scripts did. Of the frames in which the right hand stays within 2 cm and 8
/// degrees of its first pose, 0.3 s are kept, evenly spaced and including the first. The clip is
/// unchanged if the hand never leaves. Returns the number of removed frames.
int TrimIdle(const Eigen::Matrix3Xd& rest_joints, Clip& clip);

/// Style in which an action is performed: it varies between people and between repetitions. Angles
/// in radians, of the posture at the end of the reach.
struct SampleStyle {
  double pace = 1.0;               ///< multiplies durations
  Eigen::Vector3d trunk{0, 0, 0};  ///< axis-angle of the whole spine in the pelvis's frame: lean
                                   ///< forward, turn left, bend right
  double elbow = 0.0;  ///< outward swivel of the acting arm about the line from shoulder to wrist
  Eigen::Vector3d other_arm{0, 0, 0};  ///< of the other upper arm, in the chest's frame
  double other_elbow = 0.0;  ///< flexion of the other elbow, >= 0; its forearm moves inwards
  /// Pelvis offset over the feet, left and forward, meters: onto one leg, whose hip rises.
  Eigen::Vector2d weight{0, 0};
};

/// Draws a style; that of sample 0 is neutral. Pace varies by a quarter, the trunk by 5 to 10
/// degrees (little backwards), the elbow by 20, the other arm by 14 with up to 70 of elbow flexion,
/// weight by 3 cm. `amount` scales all of it.
SampleStyle DrawSampleStyle(std::uint64_t seed, int sample, double amount);

/// Applies a style to key frames of a right-handed person: zero change in the first frame, full
/// when the right hand is farthest away. The hand keeps its rotation relative to the trunk, and the
/// object stays in the hand. Feet are left to a later step (MotionOfKeyFrames).
void ApplySampleStyle(const SampleStyle& style, const Eigen::Matrix3Xd& rest_joints, Clip& keys);

/// Applies `share` of a pelvis offset `weight`: the hip on that side rises, the trunk stays
/// upright.
void ShiftWeight(const Eigen::Vector2d& weight, double share, BodyFrame& frame);

/// Puts the object of a motion of the right hand between both hands, as in `both` (one frame of
/// this person): at the start it is where it is there, relative to the pelvis, and where the hand
/// is farthest away it is where the motion has it. It turns as in the motion.
void TakeInBothHands(const Eigen::Matrix3Xd& rest_joints, const Clip& both, Clip& clip);

/// Moves both arms so that the hands are on the object as in `both` (MoveWrist from the arms
/// there), and marks both as holding. Where an arm is too short, object and hands come back.
/// Returns the largest distance by which an arm still does not reach, meters.
double FollowWithBothHands(const Eigen::Matrix3Xd& rest_joints, const Clip& both, Clip& clip);

/// Appends a return to a motion in which the right hand uses an object, and a rest: the hand moves
/// the object back to its first position along the same path, and the body follows. Then the person
/// stands, looks up, and sways (AddSway with `seed`). If `lets_go`, the object stays there, the
/// fingers open, the trunk straightens and the arm comes to hang like the other one (`holding_hand`
/// 0; ClearPassages moves the hand off the object). Legs keep their first and last pose, which is
/// standing. Nothing is appended if the wrist never moved 2 cm. `clip` needs an object track and
/// holding_hand.
void AddReturn(const Eigen::Matrix3Xd& rest_joints, bool lets_go, std::uint64_t seed, Clip& clip);

/// Raises the right hand with the object where one of them would sink below a table of height
/// `table_m` (meters), as far as the deepest frame within 0.15 s needs, smoothly. Only within 40 cm
/// of the object's first position, seen from above, and while the hand holds it. The first and the
/// last such frame are unchanged.
void StayAboveTable(const Eigen::Matrix3Xd& rest_joints, const TriangleMesh& object, double table_m,
                    Clip& clip);

/// Appends only the rest, after a motion that ends with the object in a hand.
void AddRest(const Eigen::Matrix3Xd& rest_joints, std::uint64_t seed, Clip& clip);

}  // namespace holdfast
