// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "generator/wandr/goal_plan.h"
#include "generator/wandr/pose.h"
#include "generator/wandr/statistics.h"

namespace holdfast::wandr {

/// A motion to learn from, 30 frames a second.
struct CorpusClip {
  std::string name;
  bool made = false;  ///< carries goals that it was made for
  std::vector<Pose<float>> poses;
  GoalPlan goals;  ///< of the wrist, frames of this clip
};

/// What networks are trained on.
struct Corpus {
  std::vector<CorpusClip> clips;
  Statistics statistics;  ///< over all of its frames
  long captured_frames = 0, made_frames = 0;
  std::vector<std::string> notes;  ///< files that were left out, and why
};

struct CorpusOptions {
  /// Synthetic motion to take at most, in files' order; captured motion is taken whole.
  double made_hours = 1e9;
  bool captured = true;
  bool mirror = true;  ///< captured clips a second time, left and right exchanged
  Side wrist = Side::kRight;
};

/// Reads every clip (.npz) in `folders` and below, by name. Clips of at least 24 frames; with
/// arrays goal (K x 3), goal_frame (K) and goal_wrist (K; 1 right, 2 left), as `make-reach-data`
/// writes them, they count as made. Folders named `held_out` and `dropped` are passed over.
/// `progress(done, total)` may be null. Throws Error when a folder is missing or nothing is left.
Corpus ReadCorpus(const std::vector<std::filesystem::path>& folders,
                  const Eigen::Matrix3Xd& rest_joints, const CorpusOptions& options,
                  const std::function<void(int, int)>& progress);

/// The clips of one folder, held-out ones for example: no mirror images, no statistics.
std::vector<CorpusClip> ReadCorpusClips(const std::filesystem::path& folder, Side wrist,
                                        std::vector<std::string>* notes);

}  // namespace holdfast::wandr
