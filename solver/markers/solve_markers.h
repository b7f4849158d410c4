// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "geometry/clip/clip.h"
#include "geometry/io/markers/marker_recording.h"
#include "geometry/options.h"
#include "geometry/parallel.h"
#include "solver/markers/marker_calibration.h"
#include "solver/markers/marker_names.h"
#include "solver/markers/marker_track.h"
#include "solver/markers/marker_world.h"
#include "solver/markers/object_markers.h"
#include "solver/markers/unmarked_head.h"

namespace holdfast {

/// RMS distance of markers from their predicted positions, above which a result is doubtful, and
/// above which it has failed; good recordings have 1 to 5 mm.
constexpr double kDoubtfulRms_mm = 15.0, kMaxRms_mm = 30.0;

struct SolveMarkersOptions {
  MarkerTable table = MarkerTable::Known();    ///< names and sites of markers
  std::optional<UpAxis> up;                    ///< overrides the estimate from trunk and shoulders
  RestPosture posture = RestPosture::kSeated;  ///< of legs without markers
  std::optional<ObjectMarkers> object;         ///< markers on an object
  int calibration_frames = 24;                 ///< spread over the trial
};

/// Options of `solve`.
OptionTable OptionsOf(SolveMarkersOptions& options);

/// Result of one marker.
struct SolvedMarker {
  MarkerSite site;
  int seen = 0;                   ///< frames of the trial
  bool in_static = false;         ///< seen in the static trial
  int longest_gap = 0;            ///< frames, in the trial
  int outliers = 0, swapped = 0;  ///< frames
  double rms_mm = 0.0;            ///< from its predicted position, in frames where it is used
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< in the joint's frame, meters
  SkinPlace skin;
};

/// An unknown name of the recording.
struct UnusedMarker {
  std::string name;
  std::string nearest;  ///< most similar known name; empty if none is similar
};

struct MarkerReport {
  std::vector<SolvedMarker> markers;
  std::vector<UnusedMarker> unused;
  std::vector<std::string> never_seen;  ///< known names without a position in either recording
  double rms_mm = 0.0, worst_rms_mm = 0.0;
  std::string worst_marker;
  MarkerFaults faults;
  std::vector<int> unmarked;  ///< resting joints
  MarkerWorld world;
  double lift_m = 0.0;  ///< added to heights to put the soles on the ground
  std::optional<ObjectMarkerReport> object;
  HeadReport head;  ///< how an unmarked head avoids hands
  int iterations = 0;
  bool converged = false;
};

struct SolvedRecording {
  Clip clip;
  MarkerReport report;
  /// Predicted positions of the report's markers (3 M x T), in the recording's axes, meters.
  Eigen::MatrixXd carried;
  /// The markers used for solving, same layout: labels corrected; NaN for unseen markers and
  /// outliers.
  Eigen::MatrixXd used;
};

/// `holdfast solve`: fits a moving body to labeled markers. First solves shape and marker positions
/// (CalibrateMarkers) from a static trial, if any, and frames spread over the trial; then all
/// frames at once (TrackMarkers), with labels corrected (RepairMarkers), and again. Joints without
/// markers rest and are reported. A pelvis without markers is static; a head without markers avoids
/// the hands (PoseUnmarkedHead).
///
/// If some markers belong to an object, the clip has its pose in every frame (TrackObject), without
/// its mesh.
///
/// The clip has the recording's rate; z is up and the soles are on the ground. Throws Error, named
/// `where`: no known name or too few for a pose (with the nearest known names), no marker seen,
/// several subjects, a person upside down or mirrored. Single-threaded.
SolvedRecording SolveMarkers(const MarkerRecording& recording, const MarkerRecording* static_trial,
                             std::shared_ptr<const BodyModel> model,
                             const SolveMarkersOptions& options, const std::string& where,
                             const StagedProgress& progress = {});

}  // namespace holdfast
