// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

namespace holdfast {

/// The pace of somebody who goes somewhere to reach for a goal: turns towards it, walks until it is
/// within reach, and raises the arm. Frames at 30 Hz from the start, lengths in metres.
class WalkPace {
 public:
  /// A pelvis at `from` that faces `facing` (neither need be of unit length), goal at `goal`; all
  /// as seen from above.
  WalkPace(const Eigen::Vector2d& from, const Eigen::Vector2d& facing, const Eigen::Vector2d& goal);

  /// Frame in which the wrist is at the goal.
  int Deadline() const;
  /// Frame in which the pelvis is where the goal is within reach.
  double Arrival() const;
  /// Where the pelvis is in a frame, on its straight way.
  Eigen::Vector2d PelvisAt(double frame) const;
  double Length() const { return length_m_; }

 private:
  Eigen::Vector2d from_, direction_;
  double length_m_ = 0.0, turn_s_ = 0.0, ramp_s_ = 0.0, walk_s_ = 0.0, speed_m_s_ = 0.0;
};

}  // namespace holdfast
