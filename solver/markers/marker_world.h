// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "geometry/io/markers/marker_recording.h"
#include "geometry/retarget/retarget.h"
#include "solver/markers/marked_person.h"

namespace holdfast {

/// Transform of a recording to the world.
struct MarkerWorld {
  double scale = 1.0;  ///< additional factor on positions: 1000 or 0.001 for a wrong unit
  UpAxis up = UpAxis::kZ;
  Eigen::Matrix3d world_from_recording = Eigen::Matrix3d::Identity();  ///< up to z
  double facing_rad = 0.0;  ///< about world z; 0 faces -y
};

/// Returns 0.001 if millimeters are declared as meters, 1000 in the opposite case, else 1: decided
/// by the distance between the markers of one person.
double ScaleBySize(const MarkerRecording& recording);

/// Finds up axis and facing direction from trunk and shoulder markers (Kabsch). `column[k]`:
/// recording column of the person's k-th marker, -1 for none. Throws Error, named `where`, if the
/// person would be upside down and `up` does not confirm it.
MarkerWorld FindWorld(const MarkedPerson& person, const MarkerRecording& recording,
                      const std::vector<int>& column, std::optional<UpAxis> up,
                      const std::string& where);

/// Returns the recording in the world, meters, raised by `lift_m`.
MarkerRecording InWorld(const MarkerRecording& recording, const MarkerWorld& world, double lift_m);

/// Returns a root (FreePose) whose trunk is at the markers of a frame (world), with this facing.
Eigen::Matrix<double, 6, 1> RootAt(const MarkedPerson& person, const SeenMarkers& seen,
                                   double facing_rad);

/// A marker recording and the static trial of its person.
struct MarkerTrialFiles {
  std::string name;  ///< file name without extensions
  std::filesystem::path recording;
  std::filesystem::path still;  ///< empty if there is none

  /// The static trial's name before "_static", or else the folder's name.
  std::string Person() const;
};

/// Finds recordings (MarkerFormatOf) in a folder and its subfolders, sorted by path. Each person
/// has a folder; "..._static..." is the static trial of the other recordings in it. Of several, the
/// one applies whose name up to "_static" is a prefix of the recording's name. Other files are
/// ignored. Throws Error if `folder` is not a folder, for one without recordings, and for a
/// recording beside several static trials that match none.
std::vector<MarkerTrialFiles> FindMarkerTrials(const std::filesystem::path& folder);

}  // namespace holdfast
