// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "apps/common.h"
#include "apps/grasp_place_input.h"
#include "geometry/clip/clip.h"
#include "solver/carry/fit_job.h"
#include "solver/fit/fit_library.h"

namespace holdfast::apps {

/// A fit with what the command line adds to it: files, and the folder that it makes.
struct FitCommand {
  FitJob job;
  std::string output;
  std::string body;            ///< body model file; empty: the embedded body
  GraspPlaceInput place;       ///< where a new grasp has to be made
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

/// How far the arms gave way to the body, or what is in it: a line of text; empty where it is clear
/// of itself.
std::string ClearanceText(const ClearanceReport& report);

/// What FitSummaryJson has, in lines of text.
std::string SummaryText(const nlohmann::json& summary, const ContactProtocol& protocol);

}  // namespace holdfast::apps
