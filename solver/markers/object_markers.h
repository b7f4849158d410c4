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
  /// (3 x N) meters, in the frame of the object's mesh. If empty, the object's frame is at the
  /// center of its markers, with the axes of the world where they are first seen.
  Eigen::Matrix3Xd places;
};

/// Reads a table (.csv) with the header name,x,y,z and positions in meters, or parses
/// comma-separated names; "cup_*" matches all names with that prefix. Throws Error with file and
/// line, and for a name missing from the recording `where`, with the nearest name.
ObjectMarkers ObjectMarkersOf(const std::string& table_or_names, const MarkerRecording& recording,
                              const std::string& where);

/// Tracking report of an object's markers.
struct ObjectMarkerReport {
  struct Marker {
    std::string name;
    int seen = 0, longest_gap = 0, outliers = 0, swapped = 0;  ///< frames
    double rms_mm = 0.0;  ///< from its predicted position, in frames where it is used
    Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< in the object's frame, meters
  };
  std::vector<Marker> markers;
  double rms_mm = 0.0;
  std::optional<double> table_rms_mm;  ///< of estimated from given positions, if given
  /// Frames [begin, end) with fewer than three markers, which determine no pose: filled in from the
  /// surrounding frames and the remaining markers.
  std::vector<std::pair<int, int>> gaps;
  MarkerFaults faults;  ///< marker numbers are indices of `markers`
};

struct TrackedObject {
  ObjectTrack track;
  ObjectMarkerReport report;
};

/// Rigid motion that takes the points (3 x n, n > 0) nearest to their goals, by least squares
/// (Kabsch).
Eigen::Isometry3d Kabsch(const Eigen::Matrix3Xd& points, const Eigen::Matrix3Xd& goals);

/// Tracks an object's pose in every frame of a recording (world, meters) from its labeled markers.
/// Marker positions on the object are estimated as medians over frames, starting from the frame
/// with the most typical distances. Then each frame is solved independently by Kabsch with Cauchy
/// weights over markers with consistent distances: exchanged labels are swapped back, other
/// inconsistent markers are dropped. Throws Error, named `where`, if fewer than three markers are
/// ever seen at once, if they are collinear, or if given positions do not match.
TrackedObject TrackObject(const MarkerRecording& recording, const ObjectMarkers& markers,
                          const std::string& where);

}  // namespace holdfast
