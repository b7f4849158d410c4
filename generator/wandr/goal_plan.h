// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "generator/wandr/intention.h"
#include "geometry/body/skeleton.h"

namespace holdfast::wandr {

/// Where the wrist is wanted, and when.
struct Waypoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< world, meters
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
  IntentionParts parts = {};
};

/// The waypoint that counts at `frame`: the first whose deadline is still to come. -1 for none.
int ActiveWaypoint(const GoalPlan& plan, int frame, const IntentionOptions& options);

/// Waypoint and eta at `frame`, as the intention takes them.
template <typename T>
FrameGoal<T> GoalAt(const GoalPlan& plan, int frame, const IntentionOptions& options);

/// Frames to allow for a goal at a horizontal distance d, meters:
///   clamp(frames_for_reach + 30 d / walking_m_s, min_frames, max_frames).
struct DeadlineRule {
  double frames_for_reach = 42.0;  ///< to start, and to reach on arrival
  double walking_m_s = 0.95;
  double min_frames = 40.0;
  double max_frames = 240.0;

  /// The same for every distance.
  static DeadlineRule Fixed(int frames) { return {0.0, 1.0, double(frames), double(frames)}; }
  /// Throws Error unless speeds and frames are positive and min <= max.
  void Check() const;
  int Frames(double distance_m) const;
};

extern template FrameGoal<float> GoalAt<float>(const GoalPlan&, int, const IntentionOptions&);
extern template FrameGoal<double> GoalAt<double>(const GoalPlan&, int, const IntentionOptions&);

}  // namespace holdfast::wandr
