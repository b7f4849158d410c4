// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "generator/wandr/rollout.h"

namespace holdfast::wandr {

/// The pace of somebody who goes somewhere to reach for a goal: turns towards it while setting off,
/// walks until it is within reach, and raises the arm. Frames at 30 Hz from the start, lengths in
/// meters.
class WalkPace {
 public:
  struct Stand {
    Eigen::Vector2d position, facing;  ///< facing: unit
    double speed_m_s = 0.0;
  };

  /// A pelvis at `from` that faces `facing` (of any length) and moves at `velocity` (m/s), goal at
  /// `goal`; all as seen from above.
  WalkPace(const Eigen::Vector2d& from, const Eigen::Vector2d& facing,
           const Eigen::Vector2d& velocity, const Eigen::Vector2d& goal);

  /// Frame in which the wrist is at the goal.
  int Deadline() const;
  /// Frame in which the pelvis is where the goal is within reach.
  double Arrival() const { return arrival_; }
  /// Where the pelvis is in a frame.
  Stand At(double frame) const;
  Eigen::Vector2d PelvisAt(double frame) const { return At(frame).position; }
  /// Of the way.
  double Length() const { return length_m_; }

 private:
  std::vector<Stand> stands_;  // frame by frame
  double length_m_ = 0.0;
  int arrival_ = 0;
};

/// Of the pelvis of a start along the ground, m/s, as the step that led to it has it.
Eigen::Vector2d StartVelocity(const Network<float>& network, const RolloutStart<float>& start);

/// How somebody would go from a start, the pelvis at `pelvis` and moving at `velocity`, to a goal.
WalkPace PaceOf(const RolloutStart<float>& start, const Eigen::Vector3d& pelvis,
                const Eigen::Vector2d& velocity, const Eigen::Vector3d& goal);

}  // namespace holdfast::wandr
