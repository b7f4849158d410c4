// SPDX-License-Identifier: MIT
#include "generator/wandr/goal_plan.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "geometry/error.h"

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
  goal.parts = options.parts;
  goal.position = plan[index].position.template cast<T>();
  goal.frames_left =
      static_cast<T>(std::max(double(plan[index].frame - frame), options.min_frames_left));
  return goal;
}

void DeadlineRule::Check() const {
  if (frames_for_reach >= 0.0 && walking_m_s > 0.0 && min_frames >= 1.0 &&
      min_frames <= max_frames) {
    return;
  }
  throw Error(
      "deadline",
      fmt::format("{} frames and {} m/s, limited to {} to {} frames, are not a valid deadline",
                  frames_for_reach, walking_m_s, min_frames, max_frames),
      "Give 0 or more frames, a walking speed above 0, a minimum of at least 1 frame, and no "
      "maximum below the minimum");
}

int DeadlineRule::Frames(double distance_m) const {
  return static_cast<int>(std::lround(std::clamp(
      frames_for_reach + kFramesPerSecond * distance_m / walking_m_s, min_frames, max_frames)));
}

template FrameGoal<float> GoalAt<float>(const GoalPlan&, int, const IntentionOptions&);
template FrameGoal<double> GoalAt<double>(const GoalPlan&, int, const IntentionOptions&);

}  // namespace holdfast::wandr
