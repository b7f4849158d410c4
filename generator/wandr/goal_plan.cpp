// SPDX-License-Identifier: MIT
#include "generator/wandr/goal_plan.h"

#include <algorithm>
#include <cmath>

namespace holdfast::wandr {

int ActiveWaypoint(const GoalPlan& plan, int frame, const IntentionOptions& options) {
  const auto next =
      std::find_if(plan.begin(), plan.end(), [&](const Waypoint& w) { return w.frame > frame; });
  if (next != plan.end()) return static_cast<int>(next - plan.begin());
  return options.hold_last_goal ? static_cast<int>(plan.size()) - 1 : -1;
}

template <typename T>
FrameGoal<T> GoalAt(const GoalPlan& plan, int frame, const IntentionOptions& options) {
  FrameGoal<T> goal;
  const int index = ActiveWaypoint(plan, frame, options);
  if (index < 0) return goal;
  goal.active = true;
  goal.position = plan[index].position.template cast<T>();
  goal.frames_left =
      static_cast<T>(std::max(double(plan[index].frame - frame), options.min_frames_left));
  return goal;
}

int AdaptiveDeadline(double distance_m) {
  return static_cast<int>(
      std::lround(std::clamp(45.0 + kFramesPerSecond * distance_m / 0.8, 60.0, 240.0)));
}

template FrameGoal<float> GoalAt<float>(const GoalPlan&, int, const IntentionOptions&);
template FrameGoal<double> GoalAt<double>(const GoalPlan&, int, const IntentionOptions&);

}  // namespace holdfast::wandr
