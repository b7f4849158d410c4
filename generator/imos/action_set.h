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

/// Which subjects are for what; all others are trained on. The defaults are the published split of
/// GRAB: s2-s9 to train, s1 to validate, s10 to test.
struct SubjectSplit {
  std::vector<std::string> validation{"s1"};
  std::vector<std::string> test{"s10"};
};

struct ActionSetOptions {
  SequenceOptions sequences;
  SubjectSplit split;
  std::vector<std::string> without;  ///< actions to leave out, by name: as published, "lift"
  int threads = 1;
};

/// Sequences by what they are for, each in the order of folders, then of file names.
struct ActionSet {
  std::vector<ActionSequence> train, validation, test;
  std::vector<std::string> notes;  ///< files that were left out, and why
};

/// Reads every clip (.npz) in `folders` and below, folders named `dropped` passed over. The subject
/// is the clip's, or the folder's name where the clip has none. Clips without key frames (shorter
/// than 15 frames; by the paper's rule, without 20 frames of contact) are left out with a note.
/// `progress(done, total)` may be null. Throws Error, naming the file, for what cannot be read, for
/// clips without object, for actions and objects that are not in the vocabulary; and naming the
/// folder when there is none, or it has no sequences.
ActionSet ReadActionSet(const std::vector<std::filesystem::path>& folders,
                        const std::shared_ptr<const BodyModel>& body,
                        const ActionSetOptions& options = {},
                        const std::function<void(int, int)>& progress = {});

}  // namespace holdfast::imos
