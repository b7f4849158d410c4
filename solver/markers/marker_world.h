// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "geometry/io/markers/marker_recording.h"
#include "solver/markers/marked_person.h"

namespace holdfast {

/// Which axis of a recording points up.
enum class MarkerUp { kX, kY, kZ, kMinusX, kMinusY, kMinusZ };
std::string_view MarkerUpName(MarkerUp up);

/// How a recording lies in the world.
struct MarkerWorld {
  double scale = 1.0;  ///< that positions are multiplied by besides: 1000 or 0.001 for a wrong unit
  MarkerUp up = MarkerUp::kZ;
  Eigen::Matrix3d world_from_recording = Eigen::Matrix3d::Identity();  ///< up to z
  double facing_rad = 0.0;  ///< about world z; 0 faces -y
};

/// 1, or what turns millimeters that are called meters into meters (0.001), or the other way round
/// (1000): by the distance between the markers of one person.
double ScaleBySize(const MarkerRecording& recording);

/// Up and facing from where trunk and shoulders' markers are (Kabsch). `column[k]` is the marker of
/// the recording that is the person's k-th, -1 for none. Throws Error, named `where`, where a
/// person would be upside down and `up` does not state it.
MarkerWorld FindWorld(const MarkedPerson& person, const MarkerRecording& recording,
                      const std::vector<int>& column, std::optional<MarkerUp> up,
                      const std::string& where);

/// The recording in the world, meters, raised by `lift_m`.
MarkerRecording InWorld(const MarkerRecording& recording, const MarkerWorld& world, double lift_m);

/// Where a root (FreePose) is whose trunk is about the markers of a frame (world), facing so.
Eigen::Matrix<double, 6, 1> RootAt(const MarkedPerson& person, const SeenMarkers& seen,
                                   double facing_rad);

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
