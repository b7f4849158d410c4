// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "apps/common.h"
#include "solver/synthesis/synthesize.h"

namespace holdfast::apps {

/// A synthesis with the additional inputs of the command line.
struct SynthesizeCommand {
  SynthesisJob job;
  std::string sentence;  ///< "The person drinks from the mug"; or action and object
  std::string action;
  std::string object;         ///< mesh or embedded object
  std::string from;           ///< CLIP or CLIP:FRAME with the object held; empty: a generated start
  std::string body;           ///< body model file
  std::vector<double> betas;  ///< of a generated start
  std::string weights, action_vectors;
  bool all = false;  ///< keeps all samples
  bool write_report = true;
  std::string output = "synthesized";
};

/// Prepares the start, generates a motion (Synthesize), fits the object to all frames and writes
/// the result folder (RunFitCommand). Throws Error and FitFailure.
Outcome RunSynthesize(SynthesizeCommand command, const CommonOptions& common);

}  // namespace holdfast::apps
