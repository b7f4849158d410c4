// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "generator/matching/motion_library.h"

namespace holdfast {

/// What is left of one motion while another one already plays: the difference between the two at
/// the moment of change, with its velocity, dying away to nothing (value, velocity and acceleration
/// zero) after `duration_s` along a quintic (after Bollo 2016, inertialization). The new motion is
/// followed exactly afterwards; position and velocity never jump.
class MotionBlend {
 public:
  /// Nothing is left.
  MotionBlend() = default;
  /// From two successive frames of the old motion and the same two instants of the new one, already
  /// aligned in the plane.
  MotionBlend(const BodyFrame& old_before, const BodyFrame& old_now, const BodyFrame& new_before,
              const BodyFrame& new_now, double frame_rate, double duration_s);

  /// The new motion's frame `time_s` after the change, with what is left of the old one.
  BodyFrame Apply(const BodyFrame& frame, double time_s) const;
  double Duration() const { return duration_s_; }

 private:
  using Offsets = Eigen::Matrix<double, 3, kNumBodyJoints + 1>;  // rotations, then the pelvis

  Offsets offset_ = Offsets::Zero();
  Offsets velocity_ = Offsets::Zero();
  double duration_s_ = 0.0;
};

/// How a walker on the ground is to move: to a place, there to face a direction.
struct WalkTarget {
  Eigen::Vector2d place = Eigen::Vector2d::Zero();
  double yaw_rad = 0.0;  ///< as Yaw(BodyFrame)
  double speed = 1.2;    ///< on the way, m/s
};

struct WalkState {
  Eigen::Vector2d place = Eigen::Vector2d::Zero();
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();  ///< world, m/s
  double yaw_rad = 0.0;
};

/// The unit vector that a body of this yaw faces along the ground.
Eigen::Vector2d Facing(double yaw_rad);
/// The yaw of a body that faces along a direction.
double YawToFace(const Eigen::Vector2d& direction);

/// Where a walker would be and face in 1/3, 2/3 and 1 s: turns before it walks off, slows down as
/// it comes near, faces the way it goes and in the end as the target asks.
FuturePath PlanWalk(const WalkState& now, const WalkTarget& target);

/// Standing where it is.
FuturePath PlanStand();

/// A stretch of captured motion in a made one: which, from which of its frames, how fast.
struct MotionSegment {
  int begin = 0;              ///< frame of the generated motion
  int clip = 0;               ///< of the library
  double source_frame = 0.0;  ///< at `begin`
  double rate = 1.0;          ///< source frames per made frame
};

/// Plays captured motion one frame after the other, jumping between places of the library without
/// a jump of the body: aligned in place and heading, the rest blended away. The body goes where the
/// feet that are on the ground leave it: what they slide is taken out of its way.
class MotionPlayer {
 public:
  MotionPlayer(const MotionLibrary& library, MotionLibrary::Place start, double rate);

  /// The next frame comes from `place`; what differs dies away within `blend_s`.
  void Jump(MotionLibrary::Place place, double rate, double blend_s);
  /// Adds the next frame. Only while CanStep().
  void Step();
  /// The clip goes on for at least one more frame, and one to blend from after that.
  bool CanStep() const;

  MotionLibrary::Place At() const;  ///< nearest source frame of the last frame added
  /// The move that a jump to this place would make from captured to generated motion.
  PlanarMove MoveFor(MotionLibrary::Place place) const;
  const PlanarMove& Move() const { return move_; }
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
  Eigen::Vector2d anchor_ = Eigen::Vector2d::Zero();  // way taken out of the last frame, meters
  Soles soles_ = Soles::Zero();                       // of the last frame
  int blend_frames_ = 0;                              // since the last jump
  std::vector<BodyFrame> frames_;
  std::vector<SoleBits> contacts_;
  std::vector<MotionSegment> segments_;
};

}  // namespace holdfast
