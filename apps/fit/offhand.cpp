// SPDX-License-Identifier: MIT
#include "apps/clip_input.h"
#include "apps/common.h"
#include "apps/fit_job.h"

namespace holdfast::apps {

void AddOffhandCommand(CLI::App& app, int& exit_code, const std::shared_ptr<FitLibrary>& library) {
  struct Options {
    CommonOptions common;
    FitJob job;
    std::string first_hand = "auto";
  };
  auto options = std::make_shared<Options>();
  FitJob& job = options->job;
  CLI::App* command = app.add_subcommand(
      "offhand", "Carry an object through a motion in which it passes from hand to hand");
  command->add_option("clip", job.clip, kClipHelp)->required();
  command
      ->add_option("object", job.object, "Mesh (.obj .ply .stl .off .glb .gltf) or embedded object")
      ->required();
  command
      ->add_option("-o,--output", job.output,
                   "Folder to make: clip.npz, object.ply, metrics.json, report.html")
      ->required();
  command
      ->add_option("--switch", job.handover.switch_frames,
                   "Frames where it changes hands, ascending: 60,140. Found if left out: from the "
                   "clip's object, or where the hands meet")
      ->delimiter(',')
      ->check(CLI::NonNegativeNumber);
  AddOption(*command, "--first-hand", options->first_hand, "The hand that has it first",
            CLI::IsMember({"auto", "right", "left"}));
  AddOption(*command, "--max-switches", job.handover.max_switches,
            "Where they are found: at most this many", CLI::Range(1, 100));
  AddOption(*command, "--dwell", job.handover.dwell_s,
            "Both hands hold for about this long around a switch that was given, s",
            CLI::Range(0.0, 10.0));
  AddFitJobOptions(*command, job);
  AddCommonOptions(*command, options->common, true,
                   "  holdfast offhand pass.npz apple -o passed\n"
                   "  holdfast offhand pass.npz ball.obj -o passed_ball --first-hand right "
                   "--switch 60\n");
  command->callback([options, library, &exit_code] {
    FitJob& asked = options->job;
    asked.offhand = true;
    if (options->first_hand == "right") asked.handover.first_hand = Side::kRight;
    if (options->first_hand == "left") asked.handover.first_hand = Side::kLeft;
    const Outcome outcome = RunFitJob(asked, options->common, *library);
    if (!outcome.summary.is_null()) PrintResult(options->common, outcome.summary, outcome.text);
    exit_code = outcome.exit_code;
  });
}

}  // namespace holdfast::apps
