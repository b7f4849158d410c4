// SPDX-License-Identifier: MIT
#pragma once

#include "generator/scripted/reach_motion.h"
#include "generator/training/wandr/corpus.h"
#include "generator/wandr/motion_states.h"
#include "tests/support/wandr_scene.h"

/// Motion to train on in tests: composed, not captured.
namespace holdfast::wandr::testing {

/// Somebody who stands and reaches to a place that depends on `which`, for two seconds.
inline CorpusClip ComposedClip(int which, bool made) {
  const double side = 0.1 * (which % 5) - 0.2, height = 0.9 + 0.1 * (which % 4);
  std::vector<ReachKey> keys(3);
  keys[0].wrist = {-0.25, 0.0, 0.8};
  keys[1].time_s = 1.0 + 0.1 * (which % 3);
  keys[1].wrist = {side, -0.45, height};
  keys[2].time_s = 2.0;
  keys[2].wrist = keys[0].wrist;
  const StateMatrix<double> states = StatesOfClip(MakeReachMotion(DefaultBody(), keys));
  CorpusClip clip;
  clip.name = "composed";
  clip.made = made;
  for (Eigen::Index t = 0; t < states.cols(); ++t) {
    clip.poses.push_back(PoseOf<double>(states.col(t)).Cast<float>());
  }
  if (made) {
    const int frame = static_cast<int>(30.0 * keys[1].time_s);
    const auto bones = DefaultBones().Cast<float>();
    clip.goals = {{WristPosition(bones, clip.poses[frame], Side::kRight).cast<double>(), frame}};
  }
  return clip;
}

inline Corpus ComposedCorpus(int clips = 8) {
  Corpus corpus;
  for (int k = 0; k < clips; ++k) corpus.clips.push_back(ComposedClip(k, k % 2 == 0));
  corpus.statistics = WalkingStatistics();
  for (const CorpusClip& clip : corpus.clips) {
    (clip.made ? corpus.made_frames : corpus.captured_frames) +=
        static_cast<long>(clip.poses.size());
  }
  return corpus;
}

}  // namespace holdfast::wandr::testing
