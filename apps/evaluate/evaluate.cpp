// SPDX-License-Identifier: MIT
#include "apps/common.h"
#include "apps/evaluate/evaluate_naturalness.h"
#include "apps/evaluate/evaluate_reach.h"
#include "apps/evaluate/evaluate_synthesis.h"

namespace holdfast::apps {

void AddEvaluateCommand(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("evaluate", "Reproduce the published evaluation");
  command->require_subcommand(1);
  AddEvaluateReach(*command, exit_code);
  AddEvaluateNaturalness(*command, exit_code);
  AddEvaluateSynthesis(*command, exit_code);
}

}  // namespace holdfast::apps
