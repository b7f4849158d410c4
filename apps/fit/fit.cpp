// SPDX-License-Identifier: MIT
#include "apps/clip_input.h"
#include "apps/common.h"
#include "apps/fit_job.h"

namespace holdfast::apps {

void AddFitCommand(CLI::App& app, int& exit_code, const std::shared_ptr<FitLibrary>& library) {
  struct Options {
    CommonOptions common;
    FitJob job;
    bool paper = false;
  };
  auto options = std::make_shared<Options>();
  FitJob& job = options->job;
  CLI::App* command = app.add_subcommand(
      "fit", "Fit an object to a motion: solves object pose and finger angles for every frame");
  CLI::Option* const clip = command->add_option("clip", job.clip, kClipHelp);
  CLI::Option* const object = command->add_option(
      "object", job.object, "Mesh (.obj .ply .stl .off .glb .gltf) or embedded object");
  clip->needs(object);
  command
      ->add_option(
          "-o,--output", job.output,
          "Folder to make: clip.npz, object.ply, metrics.json, report.html; of a batch, one "
          "such folder for each job, without a report, and manifest.json")
      ->required();
  AddOption(*command, "--hand", job.hand,
            "The hand that holds. auto: as the clip says, or as its object moves; without "
            "an object the right",
            CLI::IsMember({"auto", "right", "left", "both"}));
  command->add_flag("--paper", options->paper,
                    "The paper's three terms and nothing else (--recipe paper)");
  AddOption(*command, "--recipe", job.recipe,
            "holdfast: all terms; paper: the three terms of IMoS; imos-code: what its "
            "authors' code does",
            CLI::IsMember({"holdfast", "paper", "imos-code"}));
  command->add_flag("--drink", job.drink,
                    "The person drinks: the cup stands on the table until the hand takes it, is at "
                    "the mouth when the hand is, and is put back; neck and head come to its rim");
  AddFitJobOptions(*command, job);
  AddCommonOptions(
      *command, options->common, true,
      "  holdfast fit demo_drink mug -o held\n"
      "  holdfast fit walk.npz banana.obj -o held_banana --hand left --json\n"
      "  holdfast fit demo_drink mug -o drinks --drink\n"
      "  holdfast fit --batch list.txt -o fits\n"
      "  holdfast fit captured.npz phone -o held_phone --body SMPLX_NEUTRAL.npz --start 40\n");
  command->callback([options, library, &exit_code] {
    if (options->paper) options->job.recipe = "paper";
    if (options->job.object.empty()) throw CLI::RequiredError("clip and object (or --batch LIST)");
    const Outcome outcome = RunFitJob(options->job, options->common, *library);
    if (!outcome.summary.is_null()) PrintResult(options->common, outcome.summary, outcome.text);
    exit_code = outcome.exit_code;
  });
}

}  // namespace holdfast::apps
