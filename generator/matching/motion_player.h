// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "generator/matching/motion_blend.h"
#include "generator/matching/motion_library.h"
#include "generator/matching/walk_plan.h"

namespace holdfast {

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
  Eigen::Vector2d anchor_ = Eigen::Vector2d::Zero();  // way taken out of the last frame, metres
  Soles soles_ = Soles::Zero();                       // of the last frame
  int blend_frames_ = 0;                              // since the last jump
  std::vector<BodyFrame> frames_;
  std::vector<SoleBits> contacts_;
  std::vector<MotionSegment> segments_;
};

}  // namespace holdfast
