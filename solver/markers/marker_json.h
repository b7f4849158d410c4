// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "solver/markers/solve_markers.h"

namespace holdfast {

/// Report of a recording as stored in metrics.json: residuals, all marker positions, corrected
/// labels, outliers, resting joints, axes. Units in the names.
nlohmann::json MarkerReportJson(const MarkerReport& report);

/// Returns the recorded markers of a folder written by `solve`, transformed to its world: (3 M x
/// T), meters; NaN for unseen markers. Throws Error if the folder was not written by `solve`, or if
/// its recording is missing.
Eigen::MatrixXd MeasuredMarkers(const std::filesystem::path& solved);

/// Report of the adjustment of an unmarked head: frames, millimeters, degrees.
nlohmann::json HeadReportJson(const HeadReport& head);

}  // namespace holdfast
