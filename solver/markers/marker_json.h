// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "geometry/io/markers/marker_recording.h"
#include "solver/markers/keypoint_hand.h"
#include "solver/markers/solve_markers.h"

namespace holdfast {

/// Report of a recording as stored in metrics.json: residuals, all marker positions, corrected
/// labels, outliers, resting joints, axes. Units in the names.
nlohmann::json MarkerReportJson(const MarkerReport& report);

/// Report of keypoints, likewise, without its notes.
nlohmann::json KeypointReportJson(const KeypointReport& report);

/// Returns the recorded markers of a folder written by `solve`, transformed to its world: (3 M x
/// T), meters; NaN for unseen markers. Throws Error if the folder was not written by `solve`, or if
/// its recording is missing.
Eigen::MatrixXd MeasuredMarkers(const std::filesystem::path& solved);

/// Returns the recording as interpreted by its solve, in its axes, meters: exchanged labels swapped
/// back, a wrong unit corrected, and outliers and gaps filled. Body markers are filled with the
/// positions predicted by the body, object markers by the object, plus an offset that interpolates
/// linearly between the deviations at both ends of the gap. Unknown markers are unchanged.
MarkerRecording RepairedMarkers(const MarkerRecording& recording, const SolvedRecording& solved);

}  // namespace holdfast
