// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <functional>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "generator/wandr/goal_plan.h"
#include "generator/wandr/pose.h"
#include "generator/wandr/statistics.h"

namespace holdfast::wandr {

/// A training motion at 30 fps.
struct CorpusClip {
  std::string name;
  bool made = false;  ///< synthetic: has the goals that it was generated for
  std::vector<Pose<float>> poses;
  GoalPlan goals;  ///< of the wrist, in frames of this clip
};

/// Training data of a network.
struct Corpus {
  std::vector<CorpusClip> clips;
  Statistics statistics;  ///< over all frames of the corpus
  long captured_frames = 0, made_frames = 0;
  std::vector<std::string> notes;  ///< skipped files, with the reason
};

/// Reads every clip (.npz) of at least 24 frames in and below `folders`, sorted by name. Clips with
/// the arrays goal (K x 3), goal_frame (K) and goal_wrist (K; 1 right, 2 left), as written by
/// `make-reach-data`, count as synthetic; at most `made_hours` of them are read, in file order. A
/// mirror image of each captured clip is added if `mirror`. Folders named `held_out` and `dropped`
/// are skipped. `progress(done, total)` may be null. Throws Error if a folder is missing or no clip
/// is left.
Corpus ReadCorpus(const std::vector<std::filesystem::path>& folders,
                  const Eigen::Matrix3Xd& rest_joints, double made_hours, bool mirror, Side wrist,
                  const std::function<void(int, int)>& progress);

/// Returns all clips (.npz) in and below a folder, except in folders of the names `skipped`, sorted
/// by path. Throws Error with `remedy` if there is no such folder.
std::vector<std::filesystem::path> ClipsBelow(const std::filesystem::path& folder,
                                              std::initializer_list<std::string_view> skipped,
                                              const char* remedy);

/// Reads the clips of one folder, such as held-out clips, without mirror images and statistics.
std::vector<CorpusClip> ReadCorpusClips(const std::filesystem::path& folder, Side wrist,
                                        std::vector<std::string>* notes);

}  // namespace holdfast::wandr
