// SPDX-License-Identifier: MIT
#include "apps/common.h"
#include "apps/evaluate/evaluate_captures.h"
#include "apps/evaluate/evaluate_fit.h"
#include "apps/evaluate/evaluate_handovers.h"
#include "apps/evaluate/evaluate_hold.h"
#include "apps/evaluate/evaluate_markers.h"
#include "apps/evaluate/evaluate_naturalness.h"
#include "apps/evaluate/evaluate_reach.h"
#include "apps/evaluate/evaluate_synthesis.h"
#include "apps/evaluate/evaluate_transfer.h"

namespace holdfast::apps {

void AddEvaluateCommand(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("evaluate", "Reproduce the published evaluation");
  command->require_subcommand(1);

  struct Options {
    CommonOptions common;
    std::string list;
    std::string output;
    int handovers = 40;
  };
  auto options = std::make_shared<Options>();
  CLI::App* fit = command->add_subcommand(
      "fit", "Compare fits by the paper's terms, its authors' recipe and all terms");
  fit->add_option(
         "list", options->list,
         "A file with one job per line, as for 'fit --batch'; any supported motion file is a clip")
      ->required();
  fit->add_option("-o,--output", options->output,
                  "Folder for results, evaluation.json and evaluation.md; continued if it exists")
      ->required();
  AddOption(*fit, "--handovers", options->handovers, "Number of synthetic hand-overs to detect",
            CLI::Range(1, 10'000));
  AddCommonOptions(*fit, options->common, false,
                   "  holdfast evaluate fit tests/evaluation/fit.txt -o out/evaluation\n"
                   "  holdfast evaluate fit list.txt -o out/mine --json\n");
  fit->callback([options, &exit_code] {
    const Outcome outcome =
        EvaluateFit(options->list, options->output, options->handovers, options->common);
    if (!outcome.summary.is_null()) PrintResult(options->common, outcome.summary, outcome.text);
    exit_code = outcome.exit_code;
  });
  AddEvaluateReach(*command, exit_code);
  AddEvaluateNaturalness(*command, exit_code);
  AddEvaluateSynthesis(*command, exit_code);
  AddEvaluateHandovers(*command, exit_code);
  AddEvaluateHold(*command, exit_code);
  AddEvaluateMarkers(*command, exit_code);
  AddEvaluateCaptures(*command, exit_code);
  AddEvaluateTransfer(*command, exit_code);
}

}  // namespace holdfast::apps
