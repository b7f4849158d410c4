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
#include "solver/carry/run_fit.h"
#include "solver/fit/prepared_object.h"
#include "solver/grasp/grasp_placement.h"

namespace holdfast::apps {

/// Grasp location as given by the user.
struct GraspPlaceInput {
  std::vector<double> at;           ///< x, y, z
  std::vector<std::string> region;  ///< groups, objects, materials, files with vertex lists
  std::vector<std::string> avoid;   ///< as `region`, or a ball: X,Y,Z,RADIUS

  bool Given() const { return !at.empty() || !region.empty() || !avoid.empty(); }
};

/// Adds --at, --region and --avoid.
void AddGraspPlaceOptions(CLI::App& command, GraspPlaceInput& input,
                          const std::string& group = "Options");

/// Returns the grasp location on an object loaded from `path_or_name` with this scale, or nullopt
/// if none is requested. Throws Error for unknown names, listing all names in the file.
std::optional<GraspPlace::Wanted> WantedPlace(const GraspPlaceInput& input,
                                              const std::string& path_or_name, double scale);

/// Form recorded in metrics.json.
nlohmann::json GraspPlaceJson(const GraspPlaceInput& input);

/// A fit with the additional inputs of the command line, and its output folder.
struct FitCommand {
  FitJob job;
  std::string output;
  std::string body;       ///< body model file; empty: the embedded body
  GraspPlaceInput place;  ///< location of a new grasp
  bool write_report = true;
  std::optional<Clip> motion;  ///< generated; used instead of `job.clip`
  nlohmann::json extra;        ///< merged into metrics.json; null for none
  /// Adds the caller's own measures of the fitted clip to metrics.json.
  std::function<void(const Clip& fitted, nlohmann::json& metrics)> measure;
};

/// Adds the options shared by all fits, except clip, object and output. Table options named in
/// `without` are omitted.
void AddFitOptions(CLI::App& command, FitCommand& fit, const std::vector<std::string>& without);

/// Runs the fit and writes its folder atomically. Throws Error and FitFailure.
Outcome RunFitCommand(const FitCommand& fit, const CommonOptions& common, FitLibrary& library);

/// Returns a line of text on how far the arms avoided the body, or on collisions with it; empty if
/// there are none.
std::string ClearanceText(const ClearanceReport& report);

/// Formats the content of FitSummaryJson as lines of text.
std::string SummaryText(const nlohmann::json& summary, const ContactProtocol& protocol);

}  // namespace holdfast::apps
