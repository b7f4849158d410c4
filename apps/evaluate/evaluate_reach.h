// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "apps/common.h"

namespace holdfast::apps {

struct EvaluateReachOptions {
  std::string weights;                        ///< empty: the embedded network
  std::vector<std::string> starts;            ///< folders or clips; empty: six composed poses
  std::vector<std::string> ablation_weights;  ///< "NAME=FILE": networks trained without parts
  std::string deadline = "both";              ///< both, adaptive or fixed
  bool ablations = true;
  int samples = 5;
  double sigma = 1.0;
  std::vector<std::string> methods = {"intention"};  ///< ReachMethodNames, or "all"
  int goals = 0;                                     ///< 0: all of the protocol's
  bool track = false;                                ///< goals that move (EvaluateTrack)
  std::string output;
};

/// The protocol of WANDR with all rows of its ablation table: blocks of motions, results.json,
/// results.md and report.html in a folder, continued when it is there already.
Outcome EvaluateReach(const EvaluateReachOptions& options, const CommonOptions& common);

/// Whether what is asked goes beyond the paper's own tables: other methods, or a part of the goals.
bool ComparesMethods(const EvaluateReachOptions& options);

/// The methods side by side on the first `goals` cases of the protocol (SpreadCases): blocks of
/// motions, results.json, results.md and report.html in a folder, continued when it is there.
Outcome CompareReachMethods(const EvaluateReachOptions& options, const CommonOptions& common);

/// Adds `reach` to the evaluate command.
void AddEvaluateReach(CLI::App& evaluate, int& exit_code);

}  // namespace holdfast::apps
