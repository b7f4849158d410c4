// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "generator/wandr/rollout.h"

namespace holdfast::wandr {

/// Pace of a person who walks to a goal and reaches for it: turns towards the goal while setting
/// off, walks until it is within reach, and raises the arm. Frames at 30 Hz from the start, meters.
class WalkPace {
 public:
  struct Stand {
    Eigen::Vector2d position, facing;  ///< facing: unit
    double speed_m_s = 0.0;
  };

  /// The pelvis starts at `from`, faces `facing` (any length) and moves at `velocity` (m/s) towards
  /// `goal`; all seen from above.
  WalkPace(const Eigen::Vector2d& from, const Eigen::Vector2d& facing,
           const Eigen::Vector2d& velocity, const Eigen::Vector2d& goal);

  /// Frame in which the wrist is at the goal.
  int Deadline() const;
  /// Frame in which the pelvis arrives, with the goal within reach.
  double Arrival() const { return arrival_; }
  /// Position, facing and speed of the pelvis in a frame.
  Stand At(double frame) const;
  /// Length of the path.
  double Length() const { return length_m_; }

 private:
  std::vector<Stand> stands_;  // one per frame
  double length_m_ = 0.0;
  int arrival_ = 0;
};

/// Velocity of the start's pelvis along the ground, m/s, from the delta that led to it.
Eigen::Vector2d StartVelocity(const Network<float>& network, const RolloutStart<float>& start);

/// Pace from a start to a goal, with the pelvis at `pelvis` moving at `velocity`.
WalkPace PaceOf(const RolloutStart<float>& start, const Eigen::Vector3d& pelvis,
                const Eigen::Vector2d& velocity, const Eigen::Vector3d& goal);

}  // namespace holdfast::wandr
