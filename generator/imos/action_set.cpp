// SPDX-License-Identifier: MIT
#include "generator/imos/action_set.h"

#include <algorithm>
#include <mutex>
#include <optional>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/parallel.h"

namespace holdfast::imos {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> ClipsIn(const fs::path& folder) {
  if (!fs::is_directory(folder)) {
    throw Error(folder.string(), "is not a folder of clips",
                "Give a folder that 'holdfast make-actions' wrote, or one of imported clips");
  }
  std::vector<fs::path> files;
  for (auto it = fs::recursive_directory_iterator(folder); it != fs::end(it); ++it) {
    const fs::path& path = it->path();
    if (it->is_directory() && path.filename() == "dropped") {
      it.disable_recursion_pending();
    } else if (it->is_regular_file() && path.extension() == ".npz") {
      files.push_back(path);
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

struct Read {
  std::optional<ActionSequence> sequence;
  std::string note;
};

Read ReadOne(const fs::path& path, const std::shared_ptr<const BodyModel>& body,
             const ActionSetOptions& options) {
  Clip clip = ReadClip(path);
  if (std::ranges::count(options.without, clip.action) > 0) {
    return {{}, fmt::format("{}: action {} is excluded", path.string(), clip.action)};
  }
  if (const auto lack = LackOfKeyFrames(clip, options.sequences.rule)) {
    return {{}, fmt::format("{}: {}", path.string(), *lack)};
  }
  if (clip.subject.empty()) clip.subject = path.parent_path().filename().string();
  try {
    ActionSequence sequence = SequenceFromClip(clip, body, options.sequences);
    sequence.name = path.stem().string();
    sequence.source = path.string();
    return {std::move(sequence), ""};
  } catch (const Error& error) {
    throw Error(fmt::format("{} ({})", path.string(), error.Where()), error.Problem(),
                error.Remedy());
  }
}

bool Has(const std::vector<std::string>& subjects, const std::string& subject) {
  return std::ranges::count(subjects, subject) > 0;
}

}  // namespace

ActionSet ReadActionSet(const std::vector<fs::path>& folders,
                        const std::shared_ptr<const BodyModel>& body,
                        const ActionSetOptions& options,
                        const std::function<void(int, int)>& progress) {
  std::vector<fs::path> files;
  for (const fs::path& folder : folders) {
    const std::vector<fs::path> found = ClipsIn(folder);
    files.insert(files.end(), found.begin(), found.end());
  }
  const int count = static_cast<int>(files.size());
  std::vector<Read> read(files.size());
  int done = 0;
  std::mutex progress_mutex;
  ParallelFor(count, options.threads, [&](int k) {
    read[k] = ReadOne(files[k], body, options);
    const std::lock_guard lock(progress_mutex);
    if (progress) progress(++done, count);
  });
  ActionSet set;
  for (Read& one : read) {
    if (!one.sequence) {
      set.notes.push_back(std::move(one.note));
      continue;
    }
    const std::string& subject = one.sequence->subject;
    std::vector<ActionSequence>& list = Has(options.split.test, subject)         ? set.test
                                        : Has(options.split.validation, subject) ? set.validation
                                                                                 : set.train;
    list.push_back(std::move(*one.sequence));
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
