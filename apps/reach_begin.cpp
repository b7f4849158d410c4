// SPDX-License-Identifier: MIT
#include "apps/reach_begin.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>

#include <fmt/format.h>

#include "apps/clip_input.h"
#include "generator/wandr/motion_states.h"
#include "geometry/conventions/posture.h"
#include "geometry/error.h"

namespace holdfast::apps {
namespace {

constexpr double kFarthestGoal = 20.0;  // metres: nobody has been shown walking so far
constexpr double kUsualDistance = 5.0;  // metres: as far as networks are trained and evaluated
constexpr double kFastestWalk = 2.0;    // m/s

// Highest place that the body's wrist comes to with both soles on the ground.
double HighestReach(const Beginning& begin, Side side) {
  const int wrist = WristJoint(side), elbow = kJointParents[wrist], shoulder = kJointParents[elbow];
  return begin.measures.rest_joints(1, shoulder) - begin.measures.sole_y +
         begin.bones.offset.col(elbow).norm() + begin.bones.offset.col(wrist).norm();
}

}  // namespace

Eigen::Vector3d Beginning::Pelvis() const {
  return states.rightCols<1>().head<3>() + bones.offset.col(0);
}

Beginning BeginReach(const ReachJob& job, const CommonOptions& common) {
  Beginning begin;
  std::optional<int> frame;
  if (job.from.empty()) {
    begin.source = "standing";
    begin.body = LoadBody(job.body);
    begin.like.body_model = begin.body->Name();
  } else {
    std::string name;
    std::tie(name, frame) = ParseStart(job.from);
    ClipInputOptions input_options;
    input_options.body = job.body;
    ClipInput input = LoadClipInput(name, input_options, common);
    begin.source = name;
    begin.body = input.body;
    begin.betas = input.betas;
    const int frames = input.clip.NumFrames();
    if (frame && *frame >= frames) {
      throw Error(job.from, fmt::format("the clip has frames 0 to {}", frames - 1),
                  "Give one of those");
    }
    if (!begin.body->LoneHand()) RequireMetres(name, input.clip, *begin.body);
    begin.states = wandr::StatesOfClip(input.clip);
    const double rate = wandr::kFramesPerSecond / input.clip.frame_rate;
    begin.frame = std::min(static_cast<int>(std::lround(frame.value_or(frames - 1) * rate)),
                           static_cast<int>(begin.states.cols()) - 1);
    begin.states.conservativeResize(Eigen::NoChange, begin.frame + 1);
    begin.like = std::move(input.clip);
  }
  if (begin.body->LoneHand()) {
    throw Error(begin.body->Name(), "is a hand alone: it cannot walk", "Give a whole body");
  }
  const BodyMeasures measures = MeasureBody(*begin.body, begin.betas);
  begin.measures = measures;
  begin.bones = wandr::BoneOffsetsOf(measures.rest_joints);
  if (job.from.empty()) begin.states = wandr::StateOf(wandr::StandingPose(measures));
  return begin;
}

std::string GoalText(const Eigen::Vector3d& goal) {
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", goal.x(), goal.y(), goal.z());
}

std::vector<std::string> CheckGoals(std::span<const Eigen::Vector3d> goals, const Beginning& begin,
                                    const ReachJob& job, Side side) {
  std::vector<std::string> notes;
  const double pelvis_height = begin.measures.rest_joints(1, 0) - begin.measures.sole_y;
  Eigen::Vector3d from = begin.Pelvis();
  if (from.z() > pelvis_height + 0.25 || from.z() < 0.0) {
    notes.push_back(fmt::format(
        "the start's pelvis is {:.2f} m above z = 0, {:.2f} m is standing: motions are made for a "
        "ground at z = 0",
        from.z(), pelvis_height));
  }
  const double highest = HighestReach(begin, side);
  for (const Eigen::Vector3d& goal : goals) {
    const double distance = (goal - from).head<2>().norm();
    if (goal.z() < 0.0) {
      throw Error("--goal " + GoalText(goal),
                  fmt::format("is {:.2f} m below the ground z = 0", -goal.z()),
                  "Give a height of 0 or more: x and y are on the ground, z is up, metres");
    }
    if (distance > kFarthestGoal) {
      throw Error("--goal " + GoalText(goal),
                  fmt::format("is {:.1f} m away; {:.0f} m is the most that is tried", distance,
                              kFarthestGoal),
                  "Give metres, or go there by several goals (--goal again and again)");
    }
    if (distance > kUsualDistance) {
      notes.push_back(fmt::format(
          "the goal {} is {:.1f} m away; networks are trained and evaluated up to {:.0f} m: the "
          "body walks towards it for as long as that takes, and may not arrive",
          GoalText(goal), distance, kUsualDistance));
    }
    if (goal.z() > highest) {
      notes.push_back(fmt::format(
          "the goal {} is higher than the {:.2f} m that this body's wrist comes to on the ground: "
          "it will come as near as it can",
          GoalText(goal), highest));
    }
    if (job.time_s && distance / *job.time_s > kFastestWalk) {
      notes.push_back(fmt::format(
          "{:.1f} s for {:.1f} m is faster than a walk: the goal {} will be late or missed",
          *job.time_s, distance, GoalText(goal)));
    }
    from = goal;
  }
  return notes;
}

std::string WhyMissed(const Eigen::Vector3d& goal, const Eigen::Vector3d& from,
                      const Beginning& begin, const ReachJob& job, Side side, bool blocked) {
  const double highest = HighestReach(begin, side);
  if (goal.z() > highest) {
    return fmt::format("too high for this body, whose wrist comes to {:.2f} m", highest);
  }
  if (blocked) return "blocked: the goal is in an obstacle, or too near one for a hand";
  const double distance = (goal - from).head<2>().norm();
  if (job.time_s && distance / *job.time_s > kFastestWalk) {
    return fmt::format("out of time: {:.1f} m in {:.1f} s is faster than a walk", distance,
                       *job.time_s);
  }
  return "no motion that the network makes came closer: try more --samples, another --seed or "
         "--method latent-opt";
}

}  // namespace holdfast::apps
