// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "geometry/clip/clip.h"
#include "geometry/io/markers/marker_recording.h"
#include "geometry/parallel.h"
#include "solver/markers/marker_calibration.h"
#include "solver/markers/marker_names.h"
#include "solver/markers/marker_track.h"
#include "solver/markers/marker_world.h"
#include "solver/markers/object_markers.h"
#include "solver/markers/unmarked_head.h"

namespace holdfast {

/// Root mean square of markers from where the body carries them, of a result that is to be looked
/// at and of one that failed; recordings that fit have 1 to 5 mm.
constexpr double kDoubtfulRms_mm = 15.0, kMaxRms_mm = 30.0;

struct SolveMarkersOptions {
  MarkerTable table = MarkerTable::Known();    ///< names, and where their markers are
  std::optional<MarkerUp> up;                  ///< in place of what trunk and shoulders tell
  RestPosture posture = RestPosture::kSeated;  ///< of legs without a marker
  std::optional<ObjectMarkers> object;         ///< markers that are on an object
  int calibration_frames = 24;                 ///< of the trial, spread over it
  MarkerScales scales;
};

/// What became of each marker.
struct SolvedMarker {
  MarkerSite site;
  int seen = 0;                   ///< frames of the trial
  bool in_static = false;         ///< seen in the static trial
  int longest_gap = 0;            ///< frames, in the trial
  int outliers = 0, swapped = 0;  ///< frames
  double rms_mm = 0.0;            ///< from where the body carries it, in frames where it is used
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< in the joint's frame, meters
  SkinPlace skin;
};

/// A name of the recording that is not known.
struct UnusedMarker {
  std::string name;
  std::string nearest;  ///< the known name that may be meant; empty where none is alike
};

struct MarkerReport {
  std::vector<SolvedMarker> markers;
  std::vector<UnusedMarker> unused;
  std::vector<std::string> never_seen;  ///< known names without a position in either recording
  double rms_mm = 0.0, worst_rms_mm = 0.0;
  std::string worst_marker;
  MarkerFaults faults;
  std::vector<int> unmarked;  ///< joints that rest
  MarkerWorld world;
  double lift_m = 0.0;  ///< added to heights, so that the soles are on the ground
  std::optional<ObjectMarkerReport> object;
  HeadReport head;  ///< how an unmarked one avoided hands
  int iterations = 0;
  bool converged = false;
};

struct SolvedRecording {
  Clip clip;
  MarkerReport report;
  /// Where the body carries the markers of the report (3 M x T), in the recording's axes, meters.
  Eigen::MatrixXd carried;
  /// The markers as the body was solved from them, alike: labels put right; NaN where one is not
  /// seen, or an outlier.
  Eigen::MatrixXd used;
};

/// `holdfast solve`: labeled markers to a body in motion. Shape and places of the markers first
/// (CalibrateMarkers), from a static trial where there is one and frames spread over the trial;
/// then all frames at once (TrackMarkers), labels put right (RepairMarkers), and again. Joints
/// without markers rest and are reported; a pelvis without markers keeps its place, a head gives
/// way to hands (PoseUnmarkedHead).
///
/// Where some are an object's, the clip has its pose in every frame (TrackObject); its mesh is not
/// asked for.
///
/// The clip has the recording's rate; z is up and soles are on the ground. Errors name `where`:
/// no known name or too few to tell a pose (with the nearest known names), no marker seen, several
/// subjects, a person upside down or mirrored. One core.
SolvedRecording SolveMarkers(const MarkerRecording& recording, const MarkerRecording* static_trial,
                             std::shared_ptr<const BodyModel> model,
                             const SolveMarkersOptions& options, const std::string& where,
                             const StagedProgress& progress = {});

}  // namespace holdfast
