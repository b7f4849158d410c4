// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "geometry/clip/clip.h"
#include "geometry/io/markers/marker_recording.h"
#include "solver/markers/marker_track.h"

namespace holdfast {

/// N markers of an object, a rigid cluster.
struct ObjectMarkers {
  std::vector<std::string> names;  ///< N
  /// (3 x N) meters, in the frame of the object's mesh; empty: the object's frame is put in the
  /// middle of its markers, with the axes of the world where they are first seen.
  Eigen::Matrix3Xd places;
};

/// A text of comma-separated columns with the head name,x,y,z: places in meters. Throws Error
/// naming file and line.
ObjectMarkers ReadObjectMarkers(const std::filesystem::path& path);
/// Such a file by its name (.csv), or names with commas between; "cup_*" is all that begin so.
/// Throws Error for a name that the recording, called `where`, does not have, naming the nearest.
ObjectMarkers ObjectMarkersOf(const std::string& table_or_names, const MarkerRecording& recording,
                              const std::string& where);

/// What became of an object's markers.
struct ObjectMarkerReport {
  struct Marker {
    std::string name;
    int seen = 0, longest_gap = 0, outliers = 0, swapped = 0;  ///< frames
    double rms_mm = 0.0;  ///< from where the object carries it, where it is used
    Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< in the object's frame, meters
  };
  std::vector<Marker> markers;
  double rms_mm = 0.0;
  std::optional<double> table_rms_mm;  ///< of places found from those told, where they were told
  /// Frames [begin, end) in which fewer than three markers tell no pose: filled in from the frames
  /// around and the markers that are there.
  std::vector<std::pair<int, int>> gaps;
  MarkerFaults faults;  ///< marker numbers are places in `markers`
};

struct TrackedObject {
  ObjectTrack track;
  ObjectMarkerReport report;
};

/// Labeled markers of an object to its pose in every frame of a recording (world, meters). Where
/// the markers are on it is found from the recording: medians over frames, from the frame whose
/// distances are most usual. Then each frame by itself, Kabsch with Cauchy's weights, of the
/// markers whose distances agree: two whose labels stand for each other are changed back, others
/// left out. Throws Error, named `where`: fewer than three markers that are ever seen at a time, on
/// a line, or places told that are not the recording's.
TrackedObject TrackObject(const MarkerRecording& recording, const ObjectMarkers& markers,
                          const std::string& where);

}  // namespace holdfast
