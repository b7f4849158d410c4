// SPDX-License-Identifier: MIT
#include "generator/wandr/reach_goals.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include <fmt/format.h>

#include "generator/nn/random_stream.h"
#include "generator/wandr/motion_states.h"
#include "generator/wandr/pose.h"
#include "generator/wandr/reach_outcome.h"
#include "generator/wandr/walk_pace.h"
#include "geometry/error.h"
#include "geometry/parallel.h"

namespace holdfast::wandr {
namespace {

// State of one body: its current goal, and when to switch to the next.
class GoalSequenceRollout {
 public:
  GoalSequenceRollout(const Network<float>& network, std::span<const Eigen::Vector3d> goals,
                      const ReachGoalsOptions& options)
      : network_(network), goals_(goals), options_(options) {
    sample_.goals.resize(goals.size());
  }

  /// Adds a frame of the body; returns false if it was the last.
  bool See(const RolloutStart<float>& body, const BodyJoints<float>& joints) {
    states_.push_back(StateOf(body.pose));
    joints_.push_back(joints);
    const int frame = static_cast<int>(states_.size()) - 1;
    if (!joints.allFinite() || !states_.back().allFinite()) {
      states_.pop_back();
      joints_.pop_back();
      sample_.diverged = true;
      if (current_ >= 0) sample_.goals[current_].left = frame - 1;
      return false;
    }
    if (frame == 0) TakeOn(0, frame, body);
    Approach(frame);
    const GoalOutcome& goal = sample_.goals[current_];
    const bool closer = goal.closest_frame == frame;
    const int overtime = (goal.due - goal.taken_on + 1) / 2;
    const bool late = frame >= goal.due + overtime, too_late = frame >= goal.due + 2 * overtime;
    if (lingering_ > 0) {
      if (closer && !too_late) lingering_ = options_.lingering_frames + 1;
      sample_.goal_of_frame.push_back(current_);
      sample_.goals[current_].left = frame;
      return --lingering_ > 0;
    }
    const bool arrived = goal.Reached() && !closer;
    if (arrived || too_late || (late && !closer)) {
      sample_.goals[current_].left = frame;
      if (current_ + 1 < static_cast<int>(goals_.size())) {
        TakeOn(current_ + 1, frame, body);
        Approach(frame);
      } else if (arrived && options_.lingering_frames > 0) {
        lingering_ = options_.lingering_frames;
      } else {
        sample_.goal_of_frame.push_back(current_);
        return false;
      }
    }
    sample_.goal_of_frame.push_back(current_);
    return true;
  }

  /// The current goal, with its deadline counted from the last frame added.
  Waypoint Next() const {
    const int frame = static_cast<int>(states_.size()) - 1;
    return {goals_[current_], std::max(sample_.goals[current_].due - frame, 1)};
  }

  ReachSample Finish() {
    const auto frames = static_cast<Eigen::Index>(states_.size());
    sample_.track.states.resize(kStateSize, frames);
    sample_.track.joints.resize(kJointNumbers, frames);
    for (Eigen::Index f = 0; f < frames; ++f) {
      sample_.track.states.col(f) = states_[static_cast<std::size_t>(f)];
      Eigen::Map<BodyJoints<float>>(sample_.track.joints.col(f).data()) =
          joints_[static_cast<std::size_t>(f)];
    }
    return std::move(sample_);
  }

 private:
  void TakeOn(int index, int frame, const RolloutStart<float>& body) {
    current_ = index;
    GoalOutcome& goal = sample_.goals[index];
    const Eigen::Vector3d pelvis = joints_.back().col(0).cast<double>();
    goal.taken_on = frame;
    goal.due = frame + (options_.frames ? *options_.frames : TimeFor(body, pelvis, goals_[index]));
    goal.closest_m = INFINITY;
  }

  int TimeFor(const RolloutStart<float>& body, const Eigen::Vector3d& pelvis,
              const Eigen::Vector3d& goal) const {
    const WalkPace pace = PaceOf(body, pelvis, StartVelocity(network_, body), goal);
    return static_cast<int>(std::lround(options_.slack * pace.Deadline()));
  }

  void Approach(int frame) {
    GoalOutcome& goal = sample_.goals[current_];
    const int wrist = WristJoint(options_.intention.wrist);
    goal.See(frame, (joints_.back().col(wrist).cast<double>() - goals_[current_]).norm());
  }

  const Network<float>& network_;
  std::span<const Eigen::Vector3d> goals_;
  const ReachGoalsOptions& options_;
  ReachSample sample_;
  std::vector<StateVector<float>> states_;
  std::vector<BodyJoints<float>> joints_;
  int current_ = -1;
  int lingering_ = 0;
};

// Runs samples [first, first + size) together. Every step is a separate rollout from the current
// states, because the next goal depends on what has happened.
void RunBatch(const Network<float>& network, const BoneOffsets<float>& bones,
              const RolloutStart<float>& start, std::span<const Eigen::Vector3d> goals, int first,
              std::span<ReachSample> samples, const ReachGoalsOptions& options) {
  const int size = static_cast<int>(samples.size());
  IntentionOptions intention = options.intention;
  intention.hold_last_goal = true;
  Rollout<float> rollout(network, bones, size, 1, intention);
  std::vector<GoalSequenceRollout> errands(size, GoalSequenceRollout(network, goals, options));
  std::vector<nn::RandomStream> latent_streams;  // of DrawLatents, value by value
  std::vector<RolloutStart<float>> bodies(size, start);
  BodyKinematics<float> kinematics;
  std::vector<int> moving;
  for (int i = 0; i < size; ++i) {
    latent_streams.emplace_back(options.seed, static_cast<std::uint64_t>(first + i));
    ForwardKinematics(bones, start.pose, kinematics);
    if (errands[i].See(start, kinematics.joints)) moving.push_back(i);
  }
  std::vector<RolloutStart<float>> here;
  std::vector<GoalPlan> plans;
  Eigen::MatrixXf latents(network.LatentSize(), size);
  while (!moving.empty()) {
    const int count = static_cast<int>(moving.size());
    here.clear();
    plans.clear();
    for (int k = 0; k < count; ++k) {
      const int i = moving[k];
      here.push_back(bodies[i]);
      plans.push_back({errands[i].Next()});
      for (float& latent : latents.col(k)) {
        latent = static_cast<float>(options.sigma * latent_streams[i].Normal());
      }
    }
    rollout.Begin(here, plans);
    rollout.Step(latents.leftCols(count));
    std::vector<int> still;
    for (int k = 0; k < count; ++k) {
      const int i = moving[k];
      bodies[i] = {rollout.Poses(1)[k], rollout.PreviousDelta().col(k)};
      ForwardKinematics(bones, bodies[i].pose, kinematics);
      if (errands[i].See(bodies[i], kinematics.joints)) still.push_back(i);
    }
    moving = std::move(still);
  }
  for (int i = 0; i < size; ++i) samples[i] = errands[i].Finish();
}

}  // namespace

void GoalOutcome::See(int frame, double distance_m) {
  if (distance_m < closest_m) {
    closest_m = distance_m;
    closest_frame = frame;
  }
  if (distance_m <= kReachedWithin && !Reached()) reached = frame;
}

int ReachSample::NumReached() const {
  return static_cast<int>(std::ranges::count_if(goals, &GoalOutcome::Reached));
}

void MeasureGoals(std::span<const Eigen::Vector3d> goals, int wrist, ReachSample& sample) {
  for (std::size_t g = 0; g < goals.size(); ++g) {
    GoalOutcome& outcome = sample.goals[g];
    if (outcome.taken_on < 0) continue;
    outcome.closest_m = INFINITY;
    outcome.reached = -1;
    for (int t = outcome.taken_on; t <= outcome.left; ++t) {
      const Eigen::Vector3d at = sample.track.joints.block<3, 1>(3 * wrist, t).cast<double>();
      outcome.See(t, (at - goals[g]).norm());
    }
  }
}

std::vector<ReachSample> ReachGoals(const Network<float>& network, const BoneOffsets<float>& bones,
                                    const RolloutStart<float>& start,
                                    std::span<const Eigen::Vector3d> goals, int count, int threads,
                                    const ReachGoalsOptions& options,
                                    const std::function<void(int, int)>& progress) {
  if (goals.empty() || count < 1) {
    throw Error("reach", fmt::format("{} goals, {} samples", goals.size(), count),
                "Give at least one goal, and request at least one sample");
  }
  for (const Eigen::Vector3d& goal : goals) {
    if (!goal.allFinite()) {
      throw Error("goal", "it is not finite", "Give three numbers, meters");
    }
  }
  if (!StateOf(start.pose).allFinite() || !start.previous_delta.allFinite()) {
    throw Error("start pose", "it is not finite", "Check the clip it comes from");
  }
  if (options.frames && *options.frames < 1) {
    throw Error("time", fmt::format("{} frames", *options.frames), "Give at least one frame");
  }
  std::vector<ReachSample> samples(count);
  constexpr int kBatch = 16;
  const int batch = std::clamp((count + threads - 1) / std::max(threads, 1), 1, kBatch);
  std::mutex progress_mutex;
  int done = 0;
  ParallelFor((count + batch - 1) / batch, threads, [&](int b) {
    const int first = b * batch, size = std::min(batch, count - first);
    RunBatch(network, bones, start, goals, first, {samples.data() + first, std::size_t(size)},
             options);
    if (!progress) return;
    const std::lock_guard lock(progress_mutex);
    progress(done += size, count);
  });
  return samples;
}

BoneOffsets<double> MirroredBones(const BoneOffsets<double>& bones) {
  BoneOffsets<double> mirrored;
  for (int k = 0; k < kNumBodyJoints; ++k) {
    mirrored.offset.col(k) = MirroredPoint(bones.offset.col(MirrorJoint(k)));
  }
  return mirrored;
}

StateMatrix<double> MirroredStates(const Eigen::Ref<const StateMatrix<double>>& states) {
  StateMatrix<double> mirrored(kStateSize, states.cols());
  for (Eigen::Index f = 0; f < states.cols(); ++f) {
    // Mirrored bones have a mirrored pelvis J_0, so p itself is mirrored.
    const Pose<double> pose = PoseOf<double>(states.col(f));
    WriteState<double>(Mirrored(pose, Eigen::Vector3d::Zero()), mirrored.col(f));
  }
  return mirrored;
}

Eigen::Vector3d MirroredPoint(const Eigen::Vector3d& point) {
  return {-point.x(), point.y(), point.z()};
}

}  // namespace holdfast::wandr
