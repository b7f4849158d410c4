// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "geometry/import/load_clip.h"
#include "geometry/options.h"
#include "geometry/parallel.h"
#include "solver/carry/carry.h"

namespace holdfast {

/// One fit as requested by the command line or Python.
struct FitJob {
  std::string clip;    ///< its name in messages
  std::string object;  ///< as named by the user
  int start = 0;       ///< first frame to fit
  int end = -1;        ///< end frame (exclusive); -1: end of the clip
  int object_vertices = 300;
  bool regrasp = false;
  bool keep_grasp = false;
  bool no_drink = false;         ///< the clip is not searched for drinking (CarryOptions::drink)
  std::string first_grasp;       ///< file with a grasp for the first frame (GivenGrasp)
  std::string first_grasp_body;  ///< its body model; empty: the clip's
  CarryOptions carry;            ///< `grasp` is set by RunFit
};

/// Options of `fit` and `offhand`.
OptionTable OptionsOf(FitJob& job);
/// Input of a fit.
struct FitInput {
  LoadedClip motion;
  bool made = false;  ///< `motion` was generated with its object: the clip's grasp is kept
  std::shared_ptr<const LoadedObject> object;
  /// Prepares the object, decimated to the job's number of vertices. Called once.
  std::function<std::shared_ptr<const PreparedObject>()> prepare;
};

/// Result of a fit job.
struct FitRun {
  CarryReport report;
  CarryOptions options;  ///< as used
  ClipBody body;
  std::shared_ptr<const PreparedObject> object;
  std::vector<std::string> notes;     ///< decisions made during the run
  std::vector<std::string> warnings;  ///< doubts about the input or the result
  double seconds = 0.0;

  /// No warning concerns the result, and no frame failed.
  bool Sound() const;
};

/// Runs a fit: cuts the clip, selects the source of the grasp, prepares the object, and fits it to
/// the clip. `tell` receives notes ("note: ...", "warning: ...") as they arise. A report of status
/// kStopped was stopped by `progress`. Throws Error, and FitFailure if no hand can hold the object
/// or none touches it.
FitRun RunFit(const FitJob& job, FitInput input,
              const std::function<void(const std::string&)>& tell, const StagedProgress& progress);

/// Contents of metrics.json for a fit, except options outside its option table.
nlohmann::json FitMetricsJson(const FitJob& job, const FitRun& run);

}  // namespace holdfast
