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

/// How a motion takes on goals one after another.
///
/// A goal is due after a time that is counted from when it is taken on. It is left for the next
/// when the wrist has been within kReachedWithin of it and does not come closer any more; given up
/// half as long again after it was due, or twice that while the wrist still comes closer. The last
/// one is kept in mind until `lingering_frames` after the wrist was closest, if it was reached; the
/// motion ends at once if it was not.
struct ReachGoalsOptions {
  /// Frames from taking a goal on until it is due; empty: as long as turning and walking there and
  /// reaching take (WalkPace), as the body stands and moves at that moment.
  std::optional<int> frames;
  double slack = 1.0;  ///< multiplies WalkPace's time
  int lingering_frames = 15;
  IntentionOptions intention{.min_frames_left = 10.0};
  double sigma = 1.0;  ///< of the latents
  std::uint64_t seed = 1;
};

/// What became of one goal.
struct GoalOutcome {
  int taken_on = -1;       ///< frame; -1: never, the motion ended before
  int due = -1;            ///< frame
  int left = -1;           ///< frame in which the next was taken on, or the last of the motion
  int reached = -1;        ///< first frame within kReachedWithin while it was the goal; -1: never
  double closest_m = 0.0;  ///< while it was the goal
  int closest_frame = -1;

  bool Reached() const { return reached >= 0; }
};

/// One sample.
struct ReachSample {
  RolloutTrack track;
  std::vector<GoalOutcome> goals;
  std::vector<int> goal_of_frame;  ///< index of the goal in mind, per frame
  bool diverged = false;           ///< the network's numbers broke: frames up to there

  int NumReached() const;
};

/// Distances to the goals anew, for a motion that was changed afterwards: `closest_m`,
/// `closest_frame` and `reached` of every goal between being taken on and left. `wrist`: joint id.
void MeasureGoals(std::span<const Eigen::Vector3d> goals, int wrist, ReachSample& sample);

/// Runs `count` samples in closed loop from the same start, sample i with the latents that
/// DrawLatents gives stream i of the seed. Neither threads nor the number of samples changes a
/// sample. For a left wrist see Mirrored. `progress` sees samples done, one call at a time; what it
/// throws ends the run. Throws Error for no goals or goals that are not finite.
std::vector<ReachSample> ReachGoals(const Network<float>& network, const BoneOffsets<float>& bones,
                                    const RolloutStart<float>& start,
                                    std::span<const Eigen::Vector3d> goals, int count, int threads,
                                    const ReachGoalsOptions& options = {},
                                    const std::function<void(int, int)>& progress = {});

/// The bones seen in a mirror at x = 0, sides swapped. A left wrist reaches as the right wrist of
/// the mirrored person does: with MirroredBones, MirroredStates and mirrored goals, and the motion
/// mirrored back, exactly, whatever the bones.
BoneOffsets<double> MirroredBones(const BoneOffsets<double>& bones);
StateMatrix<double> MirroredStates(const Eigen::Ref<const StateMatrix<double>>& states);
Eigen::Vector3d MirroredPoint(const Eigen::Vector3d& point);

}  // namespace holdfast::wandr
