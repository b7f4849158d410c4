// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "geometry/clip/clip_body.h"
#include "geometry/clip/corrective_basis.h"

namespace holdfast {

/// A clip with additional data for a page.
struct ReportInput : ClipScene {
  /// File of the clip; empty for an embedded clip and an imported file.
  std::filesystem::path file;
  /// Support surface of the object, in its own frame, if the clip has a track and a file of it.
  std::optional<TriangleMesh> table;
  /// World, meters: only displayed.
  std::optional<TriangleMesh> marker;
  nlohmann::json metrics;  ///< from metrics.json in the clip's folder; null without one
};

/// Reads the metrics.json that a command wrote next to a clip ("clip.npz"); null if there is none.
/// Throws Error for a file with other content.
nlohmann::json MetricsBeside(const std::filesystem::path& clip);

/// Returns curves by name (units in the names), one value per frame: all of metrics.json, and the
/// speed and height of wrists, hips and object. If metrics.json has none, also contact (closer than
/// `contact_threshold_mm`) and penetration from `distance` (per frame, meters: vertices of the
/// right hand, then of the left; empty without an object).
nlohmann::json SeriesOf(const ReportInput& input, const std::vector<Eigen::Matrix3Xd>& joints,
                        const std::vector<Eigen::VectorXd>& distance, int right_hand_vertices,
                        double contact_threshold_mm);

/// Description of a clip as text: [[name, value], ...].
nlohmann::json FactsOf(const ReportInput& input, const BodySurface& surface,
                       const CorrectiveBasis& basis);

/// Caveats that a viewer must know to interpret the picture, one sentence each.
std::vector<std::string> NotesOf(const ReportInput& input);

}  // namespace holdfast
