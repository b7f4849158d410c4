// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace holdfast {

/// A recording of markers, and the static trial of its person.
struct MarkerTrialFiles {
  std::string name;  ///< of the file, without endings
  std::filesystem::path recording;
  std::filesystem::path still;  ///< empty: there is none

  std::string Person() const { return recording.parent_path().filename().string(); }
};

/// Recordings (MarkerFormatOf) of a folder and those below it, in the order of their paths: a
/// folder a person, "..._static..." is the static trial of the others beside it. Other files are
/// passed over. Throws Error for what is not a folder, and one without recordings.
std::vector<MarkerTrialFiles> FindMarkerTrials(const std::filesystem::path& folder);

}  // namespace holdfast
