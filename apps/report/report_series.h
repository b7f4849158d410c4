// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "apps/clip_input.h"
#include "apps/report/report.h"
#include "geometry/mesh/signed_distance.h"

namespace holdfast::apps {

/// Signed distance (metres, clamped to +-limit) of each point; points farther than `limit` from the
/// object's box cost nothing.
Eigen::VectorXd DistancesWithin(const SignedDistance& object, const Eigen::Matrix3Xd& points,
                                double limit);

/// Curves by name (units in the names), one value per frame: all of metrics.json, and, where that
/// has none, contact and penetration from `distance` (per frame, metres: the vertices of the right
/// hand, then of the left; empty without an object). Always: speed and height of wrists, hips and
/// object.
nlohmann::json SeriesOf(const ClipInput& input, const std::vector<Eigen::Matrix3Xd>& joints,
                        const std::vector<Eigen::VectorXd>& distance, int right_hand_vertices,
                        const ReportOptions& options);

}  // namespace holdfast::apps
