// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "generator/wandr/intention.h"
#include "geometry/body/skeleton.h"

namespace holdfast::wandr {

/// Target position and deadline of the wrist.
struct Waypoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< world, meters
  int frame = 0;  ///< deadline, counted from frame 0 of the rollout
};

/// Waypoints by ascending deadline. Empty: no intention, the network is a motion prior.
using GoalPlan = std::vector<Waypoint>;

struct IntentionOptions {
  Side wrist = Side::kRight;
  /// Lower bound of eta, since I^w grows as 1/eta. The paper uses 1, which is no limit.
  double min_frames_left = 1.0;
  /// After the last deadline: keeps the last goal with the minimum eta if true; otherwise there is
  /// no intention (as in training).
  bool hold_last_goal = false;
  IntentionParts parts = {};
  /// Upper bound of eta: the time to walk to the goal at this speed. A person with more time walks
  /// there at that pace and waits. 0: no bound. Gradients take the bound as constant.
  double pace_m_s = 0.0;
};

/// Returns the active waypoint at `frame`: the first with a later deadline, or -1 for none.
int ActiveWaypoint(const GoalPlan& plan, int frame, const IntentionOptions& options);

/// Returns the waypoint and eta at `frame` in the form used by the intention.
template <typename T>
FrameGoal<T> GoalAt(const GoalPlan& plan, int frame, const IntentionOptions& options);

/// Time allowed for a goal at horizontal distance d (m), in frames:
///   clamp(frames_for_reach + 30 d / walking_m_s, min_frames, max_frames).
struct DeadlineRule {
  double frames_for_reach = 42.0;  ///< to start, and to reach after arrival
  double walking_m_s = 0.95;
  double min_frames = 40.0;
  double max_frames = 240.0;

  /// Throws Error unless speeds and frames are positive and min <= max.
  void Check() const;
  int Frames(double distance_m) const;
};

extern template FrameGoal<float> GoalAt<float>(const GoalPlan&, int, const IntentionOptions&);
extern template FrameGoal<double> GoalAt<double>(const GoalPlan&, int, const IntentionOptions&);

}  // namespace holdfast::wandr
