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

/// One fit as the command line or Python asks for it.
struct FitJob {
  std::string clip;    ///< as messages call it
  std::string object;  ///< as the user named it
  int start = 0;       ///< first frame of the clip to fit
  int end = -1;        ///< frame to stop before; -1: the clip's end
  int object_vertices = 300;
  bool regrasp = false;
  bool keep_grasp = false;
  CarryOptions carry;  ///< `grasp` is set by RunFit
};

/// The options of `fit` and `offhand`.
OptionTable OptionsOf(FitJob& job);
/// What a fit works on.
struct FitInput {
  LoadedClip motion;
  bool made = false;  ///< `motion` was generated with its object: the clip's grasp is kept
  std::shared_ptr<const LoadedObject> object;
  /// The object, decimated to the job's vertices. Called once.
  std::function<std::shared_ptr<const PreparedObject>()> prepare;
};

/// What came of it.
struct FitRun {
  CarryReport report;
  CarryOptions options;  ///< those that were used
  ClipBody body;
  std::shared_ptr<const PreparedObject> object;
  std::vector<std::string> notes;     ///< what was decided on the way
  std::vector<std::string> warnings;  ///< what is doubtful in the input or the result
  double seconds = 0.0;

  /// No warning names a fault of the result, and no frame failed.
  bool Sound() const;
};

/// Runs a fit: cuts the clip, decides whose grasp it is, prepares the object, and carries it
/// through the clip. `tell` sees notes ("note: ...", "warning: ...") as they come. A report of
/// status kStopped was stopped by `progress`. Throws Error, and FitFailure where no hand can hold
/// the object or none touches it.
FitRun RunFit(const FitJob& job, FitInput input,
              const std::function<void(const std::string&)>& tell, const StagedProgress& progress);

/// All that metrics.json says of a fit, except options that are not of its table.
nlohmann::json FitMetricsJson(const FitJob& job, const FitRun& run);

/// Throws FitFailure for an object that nowhere is within the span of a hand, or of both.
void RequireGraspable(const LoadedObject& object, bool both);

}  // namespace holdfast
