// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "apps/common.h"
#include "solver/synthesis/synthesize.h"

namespace holdfast::apps {

/// A synthesis with what the command line adds to it.
struct SynthesizeCommand {
  SynthesisJob job;
  std::string sentence;  ///< "The person drinks from the mug"; or action and object
  std::string action;
  std::string object;         ///< mesh or embedded object
  std::string from;           ///< CLIP or CLIP:FRAME with the object held; empty: a start is made
  std::string body;           ///< body model file
  std::vector<double> betas;  ///< of a start that is made
  std::string weights, action_embeddings;
  bool all = false;  ///< keep every sample
  bool write_report = true;
  std::string output = "synthesized";
};

/// Prepares the start, makes a motion (Synthesize) and fits the object to all of its frames
/// (RunFitCommand), whose result folder it is. Throws Error and FitFailure.
Outcome RunSynthesize(SynthesizeCommand command, const CommonOptions& common);

}  // namespace holdfast::apps
