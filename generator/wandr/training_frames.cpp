// SPDX-License-Identifier: MIT
#include "generator/wandr/training_frames.h"

#include <algorithm>
#include <cassert>

#include <fmt/format.h>

#include "generator/wandr/pose.h"
#include "generator/wandr/statistics.h"
#include "geometry/error.h"

namespace holdfast::wandr {

MotionFrames FramesOfStates(const Eigen::Ref<const StateMatrix<double>>& states,
                            const BoneOffsets<double>& bones) {
  MotionFrames motion;
  BodyKinematics<double> kinematics;
  for (Eigen::Index t = 0; t < states.cols(); ++t) {
    motion.poses.push_back(PoseOf<double>(states.col(t)));
    ForwardKinematics(bones, motion.poses.back(), kinematics);
    motion.joints.push_back(kinematics.joints);
  }
  return motion;
}

std::vector<int> HindsightGoals(const MotionFrames& motion, const HindsightOptions& options,
                                nn::RandomStream& random) {
  const int count = static_cast<int>(motion.poses.size());
  std::vector<int> goals(count), candidates;
  for (int i = 0; i < count; ++i) {
    // One draw per frame whatever comes of it: frames do not shift each other's numbers.
    const double draw = random.Uniform();
    goals[i] = i;
    if (options.labeled_goal) {
      goals[i] = std::max(i, *options.labeled_goal);
      continue;
    }
    if (options.mode == HindsightMode::kFixedOffset) {
      goals[i] = std::min(i + options.offset, count - 1);
      continue;
    }
    candidates.clear();
    for (int j = i + 1; j < count; ++j) {
      const double distance = (motion.joints[j].col(0) - motion.joints[i].col(0)).head<2>().norm();
      if (options.mode == HindsightMode::kAnyFuture || distance >= options.min_distance_m) {
        candidates.push_back(j);
      }
    }
    if (candidates.empty()) continue;
    goals[i] = candidates[static_cast<std::size_t>(draw * static_cast<double>(candidates.size()))];
  }
  return goals;
}

FrameGoal<double> HindsightGoal(const MotionFrames& motion, int frame, int goal_frame, Side wrist) {
  FrameGoal<double> goal;
  goal.active = goal_frame > frame;
  if (!goal.active) return goal;
  goal.position = motion.joints[goal_frame].col(WristJoint(wrist));
  goal.frames_left = goal_frame - frame;
  goal.heading = HeadingOf<double>(motion.poses[goal_frame].rotation[0]).Forward();
  return goal;
}

TrainingFrames MakeTrainingFrames(const MotionFrames& motion, const std::vector<int>& goal_frames,
                                  IntentionLayout layout, const Normalizer<double>& normalizer,
                                  Side wrist) {
  const int count = static_cast<int>(motion.poses.size());
  if (count < 2) {
    throw Error("training clip", fmt::format("it has {} frame(s)", count),
                "Leave clips of less than two frames out");
  }
  assert(goal_frames.size() == motion.poses.size());
  TrainingFrames frames{Eigen::MatrixXf(ConditionSize(layout), count - 1),
                        StateMatrix<float>(kStateSize, count - 1)};
  StateVector<double> delta = NormalizedDelta<double>(normalizer, RestDelta<double>());
  Eigen::VectorXd condition(ConditionSize(layout));
  for (int i = 0; i + 1 < count; ++i) {
    const Pose<double>& pose = motion.poses[i];
    const Heading<double> heading = HeadingOf<double>(pose.rotation[0]);
    WritePoseFeatures(pose, heading, normalizer, condition.data());
    condition.segment<kStateSize>(kPreviousDeltaOf) = delta;
    WriteIntention<double>(
        layout, {heading, motion.joints[i].col(0), motion.joints[i].col(WristJoint(wrist))},
        HindsightGoal(motion, i, goal_frames[i], wrist), condition.data() + kIntentionOf);
    delta = NormalizedDelta<double>(normalizer, DeltaBetween(pose, motion.poses[i + 1]));
    frames.conditions.col(i) = condition.cast<float>();
    frames.targets.col(i) = delta.cast<float>();
  }
  return frames;
}

}  // namespace holdfast::wandr
