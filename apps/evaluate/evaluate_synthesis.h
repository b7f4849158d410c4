// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "apps/common.h"
#include "apps/fit/fit_job.h"

namespace holdfast::apps {

struct EvaluateSynthesisOptions {
  std::vector<std::string> data;             ///< folders of action clips
  std::vector<std::string> held_out{"s10"};  ///< subjects that are evaluated
  std::vector<std::string> weights;          ///< "NAME=FILE"
  std::string recogniser;                    ///< file
  std::vector<std::string> objects{"given", "fitted"};
  std::vector<std::string> without;  ///< actions to leave out
  std::string key_frames = "whole";
  int object_cases = 60;   ///< sequences in which hand and object are measured, evenly over all
  int repeats = 20;        ///< with given and carried objects
  int fitted_repeats = 1;  ///< with fitted ones, which take a second each
  int at_most = 0;         ///< sequences, evenly over all; 0: all
  double sigma = 1.0;
  bool keep_clips = false;
  std::string output;
};

/// IMoS's Table 2 by both definitions, and hand and object: blocks, results.json, results.md and
/// report.html in a folder, continued when it is there already.
FitOutcome EvaluateSynthesis(const EvaluateSynthesisOptions& options, const CommonOptions& common);

/// Adds `synthesis` to the evaluate command.
void AddEvaluateSynthesis(CLI::App& evaluate, int& exit_code);

}  // namespace holdfast::apps
