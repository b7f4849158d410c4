// SPDX-License-Identifier: MIT
#include "solver/markers/marker_trials.h"

#include <algorithm>
#include <array>
#include <map>
#include <string_view>

#include "geometry/error.h"
#include "geometry/io/container/gzip.h"
#include "geometry/io/markers/marker_recording.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

bool IsRecording(const fs::path& path) {
  std::string name = path.filename().string();
  if (name.ends_with(".gz")) name.resize(name.size() - 3);
  return std::ranges::any_of(std::array{".c3d", ".trc", ".csv", ".tsv"},
                             [&](const char* ending) { return name.ends_with(ending); }) &&
         MarkerFormatOf(ReadGzipHead(path, 1024)).has_value();
}

constexpr std::string_view kStatic = "_static";

bool IsStatic(const fs::path& file) {
  return file.filename().string().find(kStatic) != std::string::npos;
}

// What its name says before that.
std::string PersonOf(const fs::path& still) {
  const std::string name = still.filename().string();
  return name.substr(0, name.find(kStatic));
}

// The one beside a recording; of several, that whose name up to "_static" its own begins with.
fs::path StillOf(const fs::path& file, const std::vector<fs::path>& beside) {
  if (beside.size() < 2) return beside.empty() ? fs::path() : beside.front();
  const std::string own = file.filename().string();
  fs::path best;
  std::size_t longest = 0;
  for (const fs::path& still : beside) {
    const std::string person = PersonOf(still);
    if (person.size() <= longest || !own.starts_with(person)) continue;
    longest = person.size();
    best = still;
  }
  if (best.empty()) {
    throw Error(file.string(), "has several static trials beside it, none by its own name",
                "Begin its name as that of its static trial, or give each person a folder");
  }
  return best;
}

}  // namespace

std::string MarkerTrialFiles::Person() const {
  const std::string person = still.empty() ? "" : PersonOf(still);
  return person.empty() ? recording.parent_path().filename().string() : person;
}

std::vector<MarkerTrialFiles> FindMarkerTrials(const fs::path& folder) {
  if (!fs::is_directory(folder)) {
    throw Error(folder.string(), "is not a folder",
                "Give one with recordings and a ..._static... file for each person");
  }
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file() && IsRecording(entry.path())) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  std::map<fs::path, std::vector<fs::path>> still;
  for (const fs::path& file : files) {
    if (IsStatic(file)) still[file.parent_path()].push_back(file);
  }
  std::vector<MarkerTrialFiles> trials;
  for (const fs::path& file : files) {
    if (IsStatic(file)) continue;
    const std::string name = file.filename().string();
    trials.push_back(
        {name.substr(0, name.find('.')), file, StillOf(file, still[file.parent_path()])});
  }
  if (trials.empty()) {
    throw Error(folder.string(), "holds no recordings of markers",
                "Give a folder with .c3d, .trc, .csv or .tsv files of labelled markers");
  }
  return trials;
}

}  // namespace holdfast
