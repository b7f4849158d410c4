// SPDX-License-Identifier: MIT
#include "generator/wandr/reach_protocol.h"

#include <mutex>
#include <numbers>

#include <fmt/format.h>

#include "generator/wandr/intention.h"
#include "generator/wandr/motion_states.h"
#include "generator/wandr/pose.h"
#include "generator/wandr/rollout.h"
#include "geometry/error.h"

namespace holdfast::wandr {
namespace {

// Value i of `count` equally spaced values over [low, high]; a single value is the midpoint.
double Spaced(int i, int count, double low, double high) {
  return count == 1 ? 0.5 * (low + high) : low + (high - low) * i / (count - 1);
}

}  // namespace

ReachProtocol ReachProtocol::Adaptive() {
  ReachProtocol protocol;
  protocol.deadline = DeadlineRule();
  protocol.intention.hold_last_goal = true;
  protocol.intention.min_frames_left = 10.0;
  return protocol;
}

void ReachProtocol::Check() const {
  const auto require = [](bool sound, const char* field, const std::string& problem,
                          const char* remedy) {
    if (!sound) throw Error(fmt::format("reach protocol: {}", field), problem, remedy);
  };
  for (const auto& [field, value] :
       {std::pair{"num_angles", num_angles}, std::pair{"num_heights", num_heights},
        std::pair{"num_distances", num_distances}, std::pair{"num_samples", num_samples}}) {
    require(value >= 1, field, fmt::format("is {}", value), "Give 1 or more");
  }
  require(num_frames >= 2, "num_frames", fmt::format("is {}", num_frames), "Give 2 or more");
  require(max_height_m >= 0.0 && max_height_m < 10.0, "max_height_m",
          fmt::format("is {} m", max_height_m), "Give a height of 0 to 10 m");
  require(min_distance_m >= 0.0 && min_distance_m <= max_distance_m && max_distance_m < 100.0,
          "min_distance_m, max_distance_m",
          fmt::format("are {} and {} m", min_distance_m, max_distance_m),
          "Give 0 <= minimum <= maximum < 100 m");
  require(sigma >= 0.0 && sigma < 10.0, "sigma", fmt::format("is {}", sigma),
          "Give 0 to 10; training uses 1");
  deadline.Check();
}

std::vector<ReachCase> ReachCases(const ReachProtocol& protocol, const BoneOffsets<float>& bones,
                                  std::span<const RolloutStart<float>> starts) {
  protocol.Check();
  if (starts.empty()) {
    throw Error("reach protocol", "there is no start pose", "Give at least one");
  }
  std::vector<ReachCase> cases;
  cases.reserve(protocol.NumCases(static_cast<int>(starts.size())));
  for (int s = 0; s < static_cast<int>(starts.size()); ++s) {
    const Pose<double> pose = starts[s].pose.Cast<double>();
    const Eigen::Vector3d pelvis = pose.translation + bones.offset.col(0).cast<double>();
    const Eigen::Vector3d ahead = HeadingOf(pose.rotation[0]).Forward();
    for (int a = 0; a < protocol.num_angles; ++a) {
      const Eigen::AngleAxisd turn(2.0 * std::numbers::pi * a / protocol.num_angles,
                                   Eigen::Vector3d::UnitZ());
      for (int h = 0; h < protocol.num_heights; ++h) {
        for (int d = 0; d < protocol.num_distances; ++d) {
          const double distance =
              Spaced(d, protocol.num_distances, protocol.min_distance_m, protocol.max_distance_m);
          Eigen::Vector3d goal = pelvis + turn * (distance * ahead);
          goal.z() = Spaced(h, protocol.num_heights, 0.0, protocol.max_height_m);
          for (int k = 0; k < protocol.num_samples; ++k) {
            cases.push_back({s, a, h, d, k, goal, protocol.deadline.Frames(distance)});
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
                                           const ReachProtocol& protocol, const ReachRun& run) {
  const std::vector<ReachCase> all = ReachCases(protocol, bones, starts);
  const int total = static_cast<int>(all.size());
  const int count = run.count < 0 ? total - run.first : run.count;
  if (run.first < 0 || count < 1 || run.first + count > total) {
    throw Error(
        "reach protocol",
        fmt::format("motions {} to {} of {} were requested", run.first, run.first + count, total),
        "Request motions within the protocol");
  }
  const std::span<const ReachCase> cases(all.data() + run.first, count);
  std::vector<RolloutStart<float>> case_starts;
  std::vector<GoalPlan> plans;
  for (const ReachCase& c : cases) {
    case_starts.push_back(starts[c.start]);
    plans.push_back(protocol.with_intention ? GoalPlan{{c.goal, c.deadline}} : GoalPlan{});
  }
  RolloutRequest request;
  request.starts = case_starts;
  request.plans = plans;
  request.num_steps = protocol.num_frames - 1;
  request.seed = protocol.seed;
  request.first_stream = static_cast<std::uint64_t>(run.first);
  request.sigma = protocol.sigma;
  RolloutOptions options;
  options.intention = protocol.intention;

  std::vector<ReachOutcome> outcomes(count);
  std::mutex progress_mutex;
  int done = 0;
  const auto finish = [&](int i, const RolloutTrack& track) {
    outcomes[i] = MeasureReach(track.joints, cases[i].goal, protocol.intention.wrist);
    if (run.see) run.see(run.first + i, track);
    if (!run.progress) return;
    const std::lock_guard lock(progress_mutex);
    run.progress(++done, count);
  };
  RunRollouts(network, bones, request, run.threads, options, [&](int i, const RolloutTrack& track) {
    if (!run.change) return finish(i, track);
    RolloutTrack changed = track;
    run.change(cases[i], changed);
    finish(i, changed);
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

std::vector<ReachStart> StartsOfClips(std::span<const Clip> clips,
                                      std::span<const std::string> names,
                                      const Normalizer<double>& normalizer, int frame) {
  if (clips.size() != names.size()) {
    throw Error("start clips", fmt::format("{} clips and {} names", clips.size(), names.size()),
                "Give one name per clip");
  }
  std::vector<ReachStart> starts;
  for (std::size_t i = 0; i < clips.size(); ++i) {
    starts.push_back({names[i], StartAtFrame(StatesOfClip(clips[i]), frame, normalizer)});
  }
  return starts;
}

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
