// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "solver/markers/solve_markers.h"

namespace holdfast {

/// What became of a recording as metrics.json has it: residuals, every marker's place, labels put
/// right, outliers, joints at rest, axes. Units in the names.
nlohmann::json MarkerReportJson(const MarkerReport& report);

/// The markers of the recording that a result folder was solved from, where solve put them in the
/// world: (3 M x T), meters; NaN where one is not seen. Throws Error where the folder is not one
/// that `solve` made, or its recording is not there any more.
Eigen::MatrixXd MeasuredMarkers(const std::filesystem::path& solved);

/// How an unmarked head was adjusted: frames, millimeters, degrees.
nlohmann::json HeadReportJson(const HeadReport& head);

}  // namespace holdfast
