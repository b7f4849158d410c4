// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "apps/common.h"
#include "geometry/clip/clip.h"
#include "solver/carry/fit_job.h"
#include "solver/fit/prepared_object.h"
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

/// A fit with what the command line adds to it: files, and the folder that it makes.
struct FitCommand {
  FitJob job;
  std::string output;
  std::string body;       ///< body model file; empty: the embedded body
  GraspPlaceInput place;  ///< where a new grasp has to be made
  bool write_report = true;
  std::optional<Clip> motion;  ///< generated, in place of what `job.clip` names
  nlohmann::json extra;        ///< merged into metrics.json; null: nothing
  /// Adds to metrics.json what only the caller knows to measure of the fitted clip.
  std::function<void(const Clip& fitted, nlohmann::json& metrics)> measure;
};

/// Adds the options that all fits share; not the clip, the object and the output. Options of the
/// table whose names are in `without` are left out.
void AddFitOptions(CLI::App& command, FitCommand& fit, const std::vector<std::string>& without);

/// Runs the fit and writes its folder, whole or not at all. Throws Error and FitFailure.
Outcome RunFitCommand(const FitCommand& fit, const CommonOptions& common, FitLibrary& library);

/// How far the arms avoided the body, or what is in it: a line of text; empty where it is clear
/// of itself.
std::string ClearanceText(const ClearanceReport& report);

/// What FitSummaryJson has, in lines of text.
std::string SummaryText(const nlohmann::json& summary, const ContactProtocol& protocol);

}  // namespace holdfast::apps
