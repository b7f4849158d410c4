// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json.hpp>

#include "solver/markers/solve_markers.h"

namespace holdfast {

/// What became of a recording as metrics.json has it: residuals, every marker's place, labels put
/// right, outliers, joints at rest, axes. Units in the names.
nlohmann::json MarkerReportJson(const MarkerReport& report);

/// How an unmarked head gave way: frames, millimetres, degrees.
nlohmann::json HeadReportJson(const HeadReport& head);

}  // namespace holdfast
