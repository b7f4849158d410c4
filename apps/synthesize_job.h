// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

#include "apps/common.h"
#include "apps/fit_job.h"
#include "apps/synthesize_start.h"

namespace holdfast::apps {

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
  double frame_rate = 30.0;
  bool all = false;  ///< keep every sample
  bool write_report = true;
  std::string output = "synthesized";
};

/// Prepares the start, makes the samples (Synthesise), chooses one, makes motion of its key frames
/// and fits the object to all frames (RunFitJob), whose result folder it is. Throws Error and
/// FitFailure.
FitOutcome RunSynthesizeJob(SynthesizeJob job, const CommonOptions& common);

}  // namespace holdfast::apps
