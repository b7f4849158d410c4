// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "generator/matching/body_frame.h"

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

}  // namespace holdfast
