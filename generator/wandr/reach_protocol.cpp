// SPDX-License-Identifier: MIT
#include "generator/wandr/reach_protocol.h"

#include <numbers>

#include "generator/wandr/intention.h"
#include "generator/wandr/motion_states.h"
#include "generator/wandr/pose.h"
#include "generator/wandr/rollout.h"
#include "geometry/clip/clip.h"

namespace holdfast::wandr {
namespace {

// Value i of `count` equally spaced values over [low, high]; a single value is the midpoint.
double Spaced(int i, int count, double low, double high) {
  return count == 1 ? 0.5 * (low + high) : low + (high - low) * i / (count - 1);
}

}  // namespace

std::vector<ReachCase> ReachCases(const ReachProtocol& protocol, const BoneOffsets<float>& bones,
                                  std::span<const RolloutStart<float>> starts) {
  const DeadlineRule deadline;
  std::vector<ReachCase> cases;
  for (int s = 0; s < static_cast<int>(starts.size()); ++s) {
    const Pose<double> pose = starts[s].pose.Cast<double>();
    const Eigen::Vector3d pelvis = pose.translation + bones.offset.col(0).cast<double>();
    const Eigen::Vector3d ahead = HeadingOf(pose.rotation[0]).Forward();
    for (int a = 0; a < protocol.num_angles; ++a) {
      const Eigen::AngleAxisd turn(2.0 * std::numbers::pi * a / protocol.num_angles,
                                   Eigen::Vector3d::UnitZ());
      for (int h = 0; h < protocol.num_heights; ++h) {
        for (int d = 0; d < protocol.num_distances; ++d) {
          const double distance = Spaced(d, protocol.num_distances, 0.5, 5.0);
          Eigen::Vector3d goal = pelvis + turn * (distance * ahead);
          goal.z() = Spaced(h, protocol.num_heights, 0.0, 1.8);
          for (int k = 0; k < protocol.num_samples; ++k) {
            cases.push_back({s, a, h, d, k, goal, deadline.Frames(distance)});
          }
        }
      }
    }
  }
  return cases;
}

std::vector<ReachOutcome> RunReachProtocol(const Network<float>& network,
                                           const BoneOffsets<float>& bones,
                                           std::span<const RolloutStart<float>> starts,
                                           const ReachProtocol& protocol, int threads) {
  const std::vector<ReachCase> cases = ReachCases(protocol, bones, starts);
  std::vector<RolloutStart<float>> case_starts;
  std::vector<GoalPlan> plans;
  for (const ReachCase& c : cases) {
    case_starts.push_back(starts[c.start]);
    plans.push_back({{c.goal, c.deadline}});
  }
  RolloutRequest request;
  request.starts = case_starts;
  request.plans = plans;
  request.num_steps = protocol.num_frames - 1;
  request.seed = protocol.seed;
  std::vector<ReachOutcome> outcomes(cases.size());
  RunRollouts(network, bones, request, threads, protocol.intention,
              [&](int i, const RolloutTrack& track) {
                outcomes[i] = MeasureReach(track.joints, cases[i].goal, protocol.intention.wrist);
              });
  return outcomes;
}

namespace {

// A reach in progress at kReachStartFrame: from hanging arms to `wrist` in 1.6 s.
struct ComposedReach {
  const char* name;
  Side side;
  Eigen::Vector3d wrist;  // meters, for a person at the origin who faces -y
  double torso_twist_rad;
  double torso_lean_rad;
  double weight_shift;
  double knee_give_m;
  double stance_width;
};

const ComposedReach kComposedReaches[] = {
    {"reaching ahead", Side::kRight, {-0.15, -0.45, 1.15}, 0.0, 0.05, 0.0, 0.0, 0.9},
    {"reaching high", Side::kRight, {-0.25, -0.25, 1.65}, 0.1, -0.05, 0.4, 0.0, 1.0},
    {"reaching low", Side::kRight, {-0.25, -0.45, 0.55}, -0.1, 0.6, -0.3, 0.12, 1.3},
    {"turned to the left", Side::kLeft, {0.50, -0.10, 1.10}, 0.6, 0.0, 0.6, 0.02, 0.8},
    {"leaning to the right", Side::kRight, {-0.60, -0.20, 0.90}, -0.5, 0.15, -0.7, 0.05, 1.5},
};

Clip MotionOf(const BodyMeasures& body, const ComposedReach& reach) {
  ReachKey key;
  key.time_s = 1.6;
  key.wrist = reach.wrist;
  key.torso_twist_rad = reach.torso_twist_rad;
  key.torso_lean_rad = reach.torso_lean_rad;
  key.weight_shift = reach.weight_shift;
  key.knee_give_m = reach.knee_give_m;
  ReachKey begin;
  begin.wrist = {reach.side == Side::kRight ? -0.28 : 0.28, -0.08, 0.80};
  ScriptedReachOptions options;
  options.side = reach.side;
  options.frame_rate = kFramesPerSecond;
  options.stance_width = reach.stance_width;
  return MakeReachMotion(body, {begin, key}, options);
}

}  // namespace

std::vector<ReachStart> ComposedStarts(const BodyMeasures& body,
                                       const Normalizer<double>& normalizer) {
  std::vector<ReachStart> starts = {{"standing", StartAtRest(StandingPose(body), normalizer)}};
  for (const ComposedReach& reach : kComposedReaches) {
    const StateMatrix<double> states = StatesOfClip(MotionOf(body, reach));
    starts.push_back({reach.name, StartAtFrame(states, kReachStartFrame, normalizer)});
  }
  return starts;
}

std::vector<RolloutStart<float>> AsFloat(std::span<const ReachStart> starts) {
  std::vector<RolloutStart<float>> out;
  for (const ReachStart& start : starts) out.push_back(start.start.Cast<float>());
  return out;
}

}  // namespace holdfast::wandr
