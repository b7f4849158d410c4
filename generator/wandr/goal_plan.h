// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "generator/wandr/intention.h"
#include "geometry/skeleton.h"

namespace holdfast::wandr {

/// Where the wrist is wanted, and when.
struct Waypoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< world, metres
  int frame = 0;  ///< deadline, counted from the start of the rollout (its frame 0)
};

/// Waypoints by ascending deadline; none means no intention: the network as a motion prior.
using GoalPlan = std::vector<Waypoint>;

struct IntentionOptions {
  Side wrist = Side::kRight;
  /// eta is kept at least this: I^w grows as 1/eta. 1 is the paper's, which does not limit it.
  double min_frames_left = 1.0;
  /// Past the last deadline: keep the last goal with the least eta, or have no intention (as
  /// training has it).
  bool hold_last_goal = false;
};

/// The waypoint that counts at `frame`: the first whose deadline is still to come. -1 for none.
int ActiveWaypoint(const GoalPlan& plan, int frame, const IntentionOptions& options);

/// Waypoint and eta at `frame`, as the intention takes them.
template <typename T>
FrameGoal<T> GoalAt(const GoalPlan& plan, int frame, const IntentionOptions& options);

/// Frames to allow for a goal at this horizontal distance: clamp(45 + 30 d / 0.8 m, 60, 240), half
/// again as long as walking there at 0.8 m/s takes when it is near.
int AdaptiveDeadline(double distance_m);

extern template FrameGoal<float> GoalAt<float>(const GoalPlan&, int, const IntentionOptions&);
extern template FrameGoal<double> GoalAt<double>(const GoalPlan&, int, const IntentionOptions&);

}  // namespace holdfast::wandr
