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

  /// What the static trial's name says before "_static", else the folder's name.
  std::string Person() const;
};

/// Recordings (MarkerFormatOf) of a folder and those below it, in the order of their paths: a
/// folder a person, "..._static..." is the static trial of the others beside it; of several, that
/// whose name up to "_static" theirs begin with. Other files are passed over. Throws Error for what
/// is not a folder, one without recordings, and a recording beside several static trials by none
/// of their names.
std::vector<MarkerTrialFiles> FindMarkerTrials(const std::filesystem::path& folder);

}  // namespace holdfast
