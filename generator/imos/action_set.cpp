// SPDX-License-Identifier: MIT
#include "generator/imos/action_set.h"

#include <algorithm>
#include <mutex>
#include <optional>

#include <fmt/format.h>

#include "generator/wandr/corpus.h"
#include "geometry/error.h"
#include "geometry/parallel.h"

namespace holdfast::imos {
namespace {

namespace fs = std::filesystem;

// Returns nullopt, and why in `note`, for a clip that is not used.
std::optional<ActionSequence> ReadOne(const fs::path& path,
                                      const std::shared_ptr<const BodyModel>& body,
                                      const ActionSetOptions& options, std::string& note) {
  Clip clip = ReadClip(path);
  if (std::ranges::count(options.without, clip.action) > 0) {
    note = fmt::format("{}: action {} is excluded", path.string(), clip.action);
    return std::nullopt;
  }
  if (const auto lack = LackOfKeyFrames(clip, options.rule)) {
    note = fmt::format("{}: {}", path.string(), *lack);
    return std::nullopt;
  }
  if (clip.subject.empty()) clip.subject = path.parent_path().filename().string();
  try {
    ActionSequence sequence = SequenceFromClip(clip, body, options.rule);
    sequence.name = path.stem().string();
    sequence.source = path.string();
    return sequence;
  } catch (const Error& error) {
    throw Error(fmt::format("{} ({})", path.string(), error.Where()), error.Problem(),
                error.Remedy());
  }
}

}  // namespace

ActionSet ReadActionSet(const std::vector<fs::path>& folders,
                        const std::shared_ptr<const BodyModel>& body,
                        const ActionSetOptions& options,
                        const std::function<void(int, int)>& progress) {
  std::vector<fs::path> files;
  for (const fs::path& folder : folders) {
    const std::vector<fs::path> found = wandr::ClipsBelow(
        folder, {"dropped"},
        "Give a folder that 'holdfast make-actions' wrote, or one of imported clips");
    files.insert(files.end(), found.begin(), found.end());
  }
  const int count = static_cast<int>(files.size());
  std::vector<std::optional<ActionSequence>> read(files.size());
  std::vector<std::string> notes(files.size());
  int done = 0;
  std::mutex progress_mutex;
  ParallelFor(count, options.threads, [&](int k) {
    read[k] = ReadOne(files[k], body, options, notes[k]);
    const std::lock_guard lock(progress_mutex);
    if (progress) progress(++done, count);
  });
  ActionSet set;
  for (int k = 0; k < count; ++k) {
    if (!read[k]) {
      set.notes.push_back(std::move(notes[k]));
      continue;
    }
    const std::string& subject = read[k]->subject;
    const auto among = [&](const std::vector<std::string>& subjects) {
      return std::ranges::count(subjects, subject) > 0;
    };
    std::vector<ActionSequence>& list = among(options.test)         ? set.test
                                        : among(options.validation) ? set.validation
                                                                    : set.train;
    list.push_back(std::move(*read[k]));
  }
  if (set.train.empty() && set.validation.empty() && set.test.empty()) {
    throw Error(folders.empty() ? "action set" : folders.front().string(),
                fmt::format("none of {} file(s) has key frames{}", count,
                            set.notes.empty() ? "" : ": " + set.notes.front()),
                "Give clips (.npz) of actions with objects, as 'holdfast make-actions' writes");
  }
  return set;
}

}  // namespace holdfast::imos
