// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "apps/common.h"
#include "apps/grasp_place_input.h"
#include "geometry/clip/clip.h"
#include "geometry/score/contact_metrics.h"
#include "solver/fit/fit.h"
#include "solver/fit/fit_library.h"
#include "solver/handover/handover_search.h"

namespace holdfast::apps {

/// What makes one result folder: a motion, an object, and how the one is fitted to the other.
struct FitJob {
  std::string clip;            ///< file or embedded clip; only a name where `motion` is there
  std::optional<Clip> motion;  ///< in place of what `clip` names
  nlohmann::json extra;        ///< merged into metrics.json; null: nothing
  /// Adds to metrics.json what only the caller knows to measure of the fitted clip.
  std::function<void(const Clip& fitted, nlohmann::json& metrics)> measure;
  std::string object;
  std::string output;
  std::string body;            ///< SMPL-X model file; empty: the embedded body
  std::string hand = "auto";   ///< right, left, both, auto
  std::string style = "auto";  ///< of a grasp that has to be made
  std::string use = "auto";    ///< what the object is taken for
  std::string normalize = "sum";
  std::string precision = "single";
  std::string solve = "sequential";
  std::string recipe = "holdfast";  ///< holdfast, paper, imos-code
  int object_vertices = 300;
  double object_scale = 1.0;
  int start = 0;
  int end = -1;
  GraspPlaceInput place;        ///< where it has to be made
  bool regrasp = false;         ///< a new grasp even if the clip has one of this object
  bool keep_grasp = false;      ///< the clip's own even if it is another object's
  bool keep_motion = false;     ///< arms do not give way to the body
  bool clear_passages = false;  ///< CarryOptions::clear_passages
  bool drink = false;           ///< the clip's person drinks: into the hand that does
  bool offhand = false;         ///< the object changes hands: `handover` says what is known of it
  HandoverSearchOptions handover;
  bool write_report = true;
  FitOptions fit;
  double contact_threshold_mm = 10.0;
  ContactProtocol protocol;
};

/// Throws at once for what no hand can hold: Error for an object that is not a size for a hand,
/// FitFailure for one that nowhere is within the span of a hand, or of `both` (WhyTooLarge).
void RequireGraspable(const LoadedObject& object, bool both);

/// Adds the options that all fits share; not the clip, the object, the output and the hand.
void AddFitJobOptions(CLI::App& command, FitJob& job);

/// The job as metrics.json records it.
nlohmann::json FitOptionsJson(const FitJob& job);

/// Runs the job and writes its folder, whole or not at all. Throws Error and FitFailure.
Outcome RunFitJob(const FitJob& job, const CommonOptions& common, FitLibrary& library);

}  // namespace holdfast::apps
