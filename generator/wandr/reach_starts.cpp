// SPDX-License-Identifier: MIT
#include "generator/wandr/reach_starts.h"

#include <algorithm>
#include <map>

#include <fmt/format.h>

#include "generator/wandr/motion_states.h"
#include "geometry/error.h"

namespace holdfast::wandr {
namespace {

// Item i of `count` spread over `size`, in the middle of its share.
int SpreadIndex(int i, int count, int size) {
  return std::min(size - 1, (2 * i + 1) * size / (2 * count));
}

// A reach that is under way at kReachStartFrame: from hanging arms to `wrist` in 1.6 s.
struct ComposedReach {
  const char* name;
  Side side;
  Eigen::Vector3d wrist;  // metres, for a person at the origin who faces -y
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

std::vector<int> ChooseStartClips(std::span<const StartCandidate> candidates, int count,
                                  int frame) {
  std::map<std::string, std::vector<int>> of_subject;
  int usable = 0;
  for (int i = 0; i < static_cast<int>(candidates.size()); ++i) {
    if (candidates[i].num_frames <= frame) continue;
    of_subject[candidates[i].subject].push_back(i);
    ++usable;
  }
  if (usable < count) {
    throw Error("start clips",
                fmt::format("{} of {} clips have more than {} frames at 30 fps, {} are needed",
                            usable, candidates.size(), frame, count),
                "Give more or longer clips");
  }
  std::vector<std::vector<int>> subjects;
  for (auto& [subject, clips] : of_subject) {
    std::sort(clips.begin(), clips.end(),
              [&](int a, int b) { return candidates[a].name < candidates[b].name; });
    subjects.push_back(clips);
  }
  // How many of each person: one more each round, by turns, until there are enough.
  const int num_subjects = static_cast<int>(subjects.size());
  std::vector<int> share(num_subjects, 0);
  if (num_subjects >= count) {
    for (int i = 0; i < count; ++i) share[SpreadIndex(i, count, num_subjects)] = 1;
  } else {
    for (int taken = 0, s = 0; taken < count; s = (s + 1) % num_subjects) {
      if (share[s] == static_cast<int>(subjects[s].size())) continue;
      ++share[s];
      ++taken;
    }
  }
  std::vector<int> chosen;
  for (int s = 0; s < num_subjects; ++s) {
    for (int i = 0; i < share[s]; ++i) {
      chosen.push_back(subjects[s][SpreadIndex(i, share[s], static_cast<int>(subjects[s].size()))]);
    }
  }
  return chosen;
}

std::vector<ReachStart> StartsOfClips(std::span<const Clip> clips,
                                      std::span<const std::string> names,
                                      const Normaliser<double>& normaliser, int frame) {
  if (clips.size() != names.size()) {
    throw Error("start clips", fmt::format("{} clips and {} names", clips.size(), names.size()),
                "Give one name per clip");
  }
  std::vector<ReachStart> starts;
  for (std::size_t i = 0; i < clips.size(); ++i) {
    starts.push_back({names[i], StartAtFrame(StatesOfClip(clips[i]), frame, normaliser)});
  }
  return starts;
}

std::vector<ReachStart> ComposedStarts(const BodyMeasures& body,
                                       const Normaliser<double>& normaliser) {
  std::vector<ReachStart> starts = {{"standing", StartAtRest(StandingPose(body), normaliser)}};
  for (const ComposedReach& reach : kComposedReaches) {
    const StateMatrix<double> states = StatesOfClip(MotionOf(body, reach));
    starts.push_back({reach.name, StartAtFrame(states, kReachStartFrame, normaliser)});
  }
  return starts;
}

std::vector<RolloutStart<float>> AsFloat(std::span<const ReachStart> starts) {
  std::vector<RolloutStart<float>> out;
  for (const ReachStart& start : starts) out.push_back(start.start.Cast<float>());
  return out;
}

}  // namespace holdfast::wandr
