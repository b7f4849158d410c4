// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "apps/common.h"
#include "solver/grasp/grasp_place.h"

namespace holdfast::apps {

/// Where a hand is to take hold, as the user says it.
struct GraspPlaceInput {
  std::vector<double> at;           ///< x, y, z
  std::vector<std::string> region;  ///< groups, objects, materials, files with vertex lists
  std::vector<std::string> avoid;   ///< the same

  bool Given() const { return !at.empty() || !region.empty() || !avoid.empty(); }
};

/// Adds --at, --region and --avoid.
void AddGraspPlaceOptions(CLI::App& command, GraspPlaceInput& input,
                          const std::string& group = "Options");

/// The place on an object that was loaded from `path_or_name` with this scale; nothing when none is
/// asked for. Throws Error for names that the file does not have, with all that it has.
std::optional<GraspPlace::Wanted> WantedPlace(const GraspPlaceInput& input,
                                              const std::string& path_or_name, double scale);

/// As metrics.json records it.
nlohmann::json GraspPlaceJson(const GraspPlaceInput& input);

}  // namespace holdfast::apps
