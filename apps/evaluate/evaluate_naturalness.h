// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "apps/common.h"
#include "apps/fit/fit_job.h"

namespace holdfast::apps {

struct EvaluateNaturalnessOptions {
  std::vector<std::string> reference;  ///< captured clips, or folders of them
  /// "LABEL=PATH" or "PATH": clips or folders; those of one label are one set.
  std::vector<std::string> against;
  std::vector<std::string> limits;  ///< captured motion whose joint limits hold; empty: reference
  std::string body;                 ///< body model; empty: the embedded one
  double least_way_m = 1.0;         ///< measures of walks ask motions that get this far
  bool moving_only = false;         ///< and so do all others
  int at_most = 0;                  ///< of each set, spread evenly; 0: all
  std::string output;
};

/// Sets of motions by the measures of motion_style.h, the first being what the others are compared
/// with: results.json, results.md, motions.csv and report.html in a new folder.
FitOutcome EvaluateNaturalness(const EvaluateNaturalnessOptions& options,
                               const CommonOptions& common);

/// Adds `naturalness` to the evaluate command.
void AddEvaluateNaturalness(CLI::App& evaluate, int& exit_code);

}  // namespace holdfast::apps
