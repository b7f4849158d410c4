// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "generator/wandr/goal_plan.h"
#include "generator/wandr/rollout.h"

namespace holdfast::wandr {

/// Options for a motion that pursues goals one after another.
///
/// A goal is due a given time after it became the current goal. The next goal follows when the
/// wrist has been within kReachedWithin and comes no closer. A goal is given up at 1.5 times the
/// due time, or 2 times while the wrist still comes closer. The last goal stays current until
/// `lingering_frames` after the closest frame if it was reached; otherwise the motion ends at once.
struct ReachGoalsOptions {
  /// Frames from becoming the current goal until the goal is due. If empty: the time for turning,
  /// walking and reaching (WalkPace) from the pose and velocity at that moment.
  std::optional<int> frames;
  double slack = 1.0;  ///< multiplies the time of WalkPace
  int lingering_frames = 15;
  IntentionOptions intention{.min_frames_left = 10.0};
  double sigma = 1.0;  ///< standard deviation of the latents
  std::uint64_t seed = 1;
};

/// Result for one goal.
struct GoalOutcome {
  int taken_on = -1;       ///< frame it became current; -1: never, the motion ended before
  int due = -1;            ///< frame
  int left = -1;           ///< frame the next became current, or the last of the motion
  int reached = -1;        ///< first frame within kReachedWithin while current; -1: never
  double closest_m = 0.0;  ///< while current
  int closest_frame = -1;

  bool Reached() const { return reached >= 0; }
  /// Takes account of the distance in a frame in which the goal is current.
  void See(int frame, double distance_m);
};

/// One sample: its motion and the results for its goals.
struct ReachSample {
  RolloutTrack track;
  std::vector<GoalOutcome> goals;
  std::vector<int> goal_of_frame;  ///< index of the current goal, per frame
  bool diverged = false;           ///< the rollout diverged (non-finite state); frames up to then

  int NumReached() const;
};

/// Recomputes `closest_m`, `closest_frame` and `reached` of every goal over the frames in which it
/// was current, for a motion that was changed afterwards. `wrist`: joint id.
void MeasureGoals(std::span<const Eigen::Vector3d> goals, int wrist, ReachSample& sample);

/// Runs `count` samples in closed loop from the same start. Sample i uses the latents of
/// DrawLatents for stream i of the seed, whatever the number of threads or samples. For a left
/// wrist see Mirrored. `progress` receives the number of completed samples, one call at a time; if
/// it throws, the run ends. Throws Error if there are no goals or a goal is not finite.
std::vector<ReachSample> ReachGoals(const Network<float>& network, const BoneOffsets<float>& bones,
                                    const RolloutStart<float>& start,
                                    std::span<const Eigen::Vector3d> goals, int count, int threads,
                                    const ReachGoalsOptions& options = {},
                                    const std::function<void(int, int)>& progress = {});

/// Bones mirrored at x = 0, sides swapped. A left wrist reaches like the right wrist of the
/// mirrored person: with MirroredBones, MirroredStates and mirrored goals, and the motion mirrored
/// back. Exact for any bones.
BoneOffsets<double> MirroredBones(const BoneOffsets<double>& bones);
StateMatrix<double> MirroredStates(const Eigen::Ref<const StateMatrix<double>>& states);
Eigen::Vector3d MirroredPoint(const Eigen::Vector3d& point);

}  // namespace holdfast::wandr
