// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "generator/imos/action_sequence.h"
#include "geometry/body/body_model.h"

namespace holdfast::imos {

struct ActionSetOptions {
  KeyFrameRule rule = KeyFrameRule::kWhole;
  /// Subjects for validation and test; all others are for training. The default is the published
  /// split of GRAB: s2-s9 for training.
  std::vector<std::string> validation{"s1"}, test{"s10"};
  std::vector<std::string> without;  ///< names of excluded actions; as published, "lift"
  int threads = 1;
};

/// Sequences per split, ordered by folder, then by file name.
struct ActionSet {
  std::vector<ActionSequence> train, validation, test;
  std::vector<std::string> notes;  ///< skipped files, with the reason
};

/// Reads every clip (.npz) in and below `folders`, except in folders named `dropped`. The subject
/// is taken from the clip, or else from the folder name. Clips without key frames (fewer than 15
/// frames, or no more than 20 frames of contact by the paper's rule) are skipped with a note.
/// `progress(done, total)` may be null. Throws Error that names the file for unreadable clips,
/// clips without object, and actions or objects outside the vocabulary; or names the folder if it
/// is missing or has no sequences.
ActionSet ReadActionSet(const std::vector<std::filesystem::path>& folders,
                        const std::shared_ptr<const BodyModel>& body,
                        const ActionSetOptions& options = {},
                        const std::function<void(int, int)>& progress = {});

}  // namespace holdfast::imos
