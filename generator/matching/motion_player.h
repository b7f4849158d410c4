// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "generator/matching/motion_library.h"

namespace holdfast {

/// Offset between two motions at a transition, which decays to zero while the new motion plays
/// (after Bollo 2016, inertialization). The offset and its velocity follow a quintic whose value,
/// velocity and acceleration are zero after `duration_s`; from then on the new motion is played
/// exactly. Position and velocity are continuous.
class MotionBlend {
 public:
  /// Zero offset.
  MotionBlend() = default;
  /// Constructs from two successive frames of the old motion and the same two instants of the new
  /// one, already aligned in the plane.
  MotionBlend(const BodyFrame& old_before, const BodyFrame& old_now, const BodyFrame& new_before,
              const BodyFrame& new_now, double frame_rate, double duration_s);

  /// The new motion's frame `time_s` after the transition, with the remaining offset added.
  BodyFrame Apply(const BodyFrame& frame, double time_s) const;

 private:
  using Offsets = Eigen::Matrix<double, 3, kNumBodyJoints + 1>;  // rotations, then the pelvis

  Offsets offset_ = Offsets::Zero();
  Offsets velocity_ = Offsets::Zero();
  double duration_s_ = 0.0;
};

/// Target of a walker on the ground: position, final heading and speed.
struct WalkTarget {
  Eigen::Vector2d place = Eigen::Vector2d::Zero();
  double yaw_rad = 0.0;  ///< as Yaw(BodyFrame)
  double speed = 1.2;    ///< walking speed, m/s
};

struct WalkState {
  Eigen::Vector2d place = Eigen::Vector2d::Zero();
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();  ///< world, m/s
  double yaw_rad = 0.0;
};

/// Returns the unit vector along the ground that a body of this yaw faces.
Eigen::Vector2d Facing(double yaw_rad);
/// Returns the yaw of a body that faces a direction.
double YawToFace(const Eigen::Vector2d& direction);

/// Predicts a walker's position and heading in 1/3, 2/3 and 1 s. It turns before it walks off,
/// slows down near the target, faces its walking direction and finally the target heading.
FuturePath PlanWalk(const WalkState& now, const WalkTarget& target);

/// Path of a body that stands still.
FuturePath PlanStand();

/// Segment of captured motion within a generated one.
struct MotionSegment {
  int begin = 0;              ///< frame of the generated motion
  int clip = 0;               ///< index in the library
  double source_frame = 0.0;  ///< at `begin`
  double rate = 1.0;          ///< source frames per generated frame
};

/// Plays captured motion frame by frame, with transitions between frames of the library. At a
/// transition the new motion is aligned in position and heading, and the remaining offset is
/// blended out. The body is moved so that planted feet do not slide.
class MotionPlayer {
 public:
  MotionPlayer(const MotionLibrary& library, MotionLibrary::Place start, double rate);

  /// Continues from `place`; the offset decays within `blend_s`.
  void Jump(MotionLibrary::Place place, double rate, double blend_s);
  /// Adds the next frame. Requires CanStep().
  void Step();
  /// Returns whether the clip has at least one more frame, and one after it to blend from.
  bool CanStep() const;

  MotionLibrary::Place At() const;  ///< nearest source frame of the last frame added
  /// Returns the move from captured to generated motion that a jump to `place` would use.
  PlanarMove MoveFor(MotionLibrary::Place place) const;
  WalkState State() const;  ///< of the last frame added

  const std::vector<BodyFrame>& Frames() const { return frames_; }
  const std::vector<SoleBits>& Contacts() const { return contacts_; }
  const std::vector<MotionSegment>& Segments() const { return segments_; }

 private:
  BodyFrame Sample(int clip, double frame) const;
  BodyFrame Next() const;  // the frame that Step() would add
  void Anchor(BodyFrame& frame, SoleBits contact);

  const MotionLibrary& library_;
  int clip_;
  double next_;  // source frame of the next step
  double rate_;
  PlanarMove move_;
  MotionBlend blend_;
  Eigen::Vector2d anchor_ = Eigen::Vector2d::Zero();  // displacement removed in the last frame (m)
  Soles soles_ = Soles::Zero();                       // of the last frame
  int blend_frames_ = 0;                              // since the last jump
  std::vector<BodyFrame> frames_;
  std::vector<SoleBits> contacts_;
  std::vector<MotionSegment> segments_;
};

}  // namespace holdfast
