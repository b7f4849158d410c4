// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/common.h"
#include "apps/fit_job.h"

namespace holdfast::apps {

/// What a synthesis begins with, as the command line asks for it.
struct SynthesisBegin {
  std::string from;    ///< CLIP or CLIP:FRAME with the object held; empty: a start is made
  std::string object;  ///< mesh or embedded object
  double object_scale = 1.0;
  std::string body;
  std::vector<double> betas;    ///< of a generated start
  bool left = false;            ///< the left hand
  std::optional<bool> in_hand;  ///< of a generated start: in the hand, not on a table; empty: drawn
};

/// One synthesis, as the command line asks for it.
struct SynthesizeJob {
  std::string sentence;  ///< "The person drinks from the mug"; or action and object
  std::string action;
  SynthesisBegin begin;
  std::string object_class;  ///< name of the vocabulary; empty: the object's own
  std::string weights, action_embeddings;
  std::optional<double> seconds;  ///< of the whole motion; empty: as long as the action usually is
  int key_frames = 15;
  int samples = 8;
  double sigma = 1.0;
  double style = 1.0;  ///< how much samples differ in pace and posture
  double frame_rate = 30.0;
  bool all = false;       ///< keep every sample
  bool and_back = false;  ///< the object goes back to where it was
  bool write_report = true;
  std::string output = "synthesized";
};

/// Prepares the start, makes a motion (Synthesize) and fits the object to all of its frames
/// (RunFitCommand), whose result folder it is. Throws Error and FitFailure.
Outcome RunSynthesizeJob(SynthesizeJob job, const CommonOptions& common);

}  // namespace holdfast::apps
