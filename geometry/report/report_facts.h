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

/// A clip with what a page shows of it besides.
struct ReportInput : ClipScene {
  /// The clip's own; empty for an embedded clip and an imported file.
  std::filesystem::path file;
  /// What the object rests on, in its own frame, where the clip has a track and a file of it.
  std::optional<TriangleMesh> table;
  /// World, meters: shown in reports where it is, and nothing else.
  std::optional<TriangleMesh> marker;
  nlohmann::json metrics;  ///< of the metrics.json beside the clip; null without one
};

/// The metrics.json that a command wrote beside a clip ("clip.npz"); null where there is none.
/// Throws Error for a file that is something else.
nlohmann::json MetricsBeside(const std::filesystem::path& clip);

/// Curves by name (units in the names), one value per frame: all of metrics.json, and, where that
/// has none, contact (closer than `contact_threshold_mm`) and penetration from `distance` (per
/// frame, meters: the vertices of the right hand, then of the left; empty without an object).
/// Always: speed and height of wrists, hips and object.
nlohmann::json SeriesOf(const ReportInput& input, const std::vector<Eigen::Matrix3Xd>& joints,
                        const std::vector<Eigen::VectorXd>& distance, int right_hand_vertices,
                        double contact_threshold_mm);

/// What a clip is, for people: [[name, value], ...].
nlohmann::json FactsOf(const ReportInput& input, const BodySurface& surface,
                       const CorrectiveBasis& basis);

/// What a viewer must know before believing the picture, one sentence each.
std::vector<std::string> NotesOf(const ReportInput& input);

}  // namespace holdfast
