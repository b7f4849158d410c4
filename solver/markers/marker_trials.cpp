// SPDX-License-Identifier: MIT
#include "solver/markers/marker_trials.h"

#include <algorithm>
#include <array>
#include <map>

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

}  // namespace

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
  const auto is_static = [](const fs::path& file) {
    return file.filename().string().find("_static") != std::string::npos;
  };
  std::map<fs::path, fs::path> still;
  for (const fs::path& file : files) {
    if (is_static(file)) still[file.parent_path()] = file;
  }
  std::vector<MarkerTrialFiles> trials;
  for (const fs::path& file : files) {
    if (is_static(file)) continue;
    const std::string name = file.filename().string();
    trials.push_back({name.substr(0, name.find('.')), file, still[file.parent_path()]});
  }
  if (trials.empty()) {
    throw Error(folder.string(), "holds no recordings of markers",
                "Give a folder with .c3d, .trc, .csv or .tsv files of labelled markers");
  }
  return trials;
}

}  // namespace holdfast
