// SPDX-License-Identifier: MIT
#include "apps/clip_input.h"
#include "apps/common.h"
#include "apps/fit_job.h"

namespace holdfast::apps {
namespace {

struct Options {
  CommonOptions common;
  FitCommand fit;
};

void Run(const Options& options, FitLibrary& library, int& exit_code) {
  const Outcome outcome = RunFitCommand(options.fit, options.common, library);
  if (!outcome.summary.is_null()) PrintResult(options.common, outcome.summary, outcome.text);
  exit_code = outcome.exit_code;
}

}  // namespace

void AddFitCommand(CLI::App& app, int& exit_code, const std::shared_ptr<FitLibrary>& library) {
  auto options = std::make_shared<Options>();
  FitCommand& fit = options->fit;
  CLI::App* command = app.add_subcommand(
      "fit", "Fit an object to a motion: solves object pose and finger angles for every frame");
  CLI::Option* const clip = command->add_option("clip", fit.job.clip, kClipHelp);
  CLI::Option* const object = command->add_option("object", fit.job.object, kObjectHelp);
  clip->needs(object);
  command
      ->add_option("-o,--output", fit.output,
                   "Output folder: clip.npz, object.ply, metrics.json, report.html; with --batch: "
                   "manifest.json, and for each job a folder with these files except report.html")
      ->required();
  AddFitOptions(*command, fit,
                {"hand_over", "switch_frames", "first_hand", "max_switches", "dwell_s"});
  command->add_flag_callback(
      "--paper", [&recipe = fit.job.carry.recipe] { recipe = FitRecipe::kPaper; },
      "Use only the three terms of the IMoS paper (same as --recipe paper)");
  AddCommonOptions(
      *command, options->common, true,
      "  holdfast fit demo_drink mug -o held\n"
      "  holdfast fit walk.npz banana.obj -o held_banana --hand left --json\n"
      "  holdfast fit demo_drink mug -o carried --drinking off\n"
      "  holdfast fit --batch list.txt -o fits\n"
      "  holdfast fit captured.npz phone -o held_phone --body SMPLX_NEUTRAL.npz --start 40\n");
  command->callback([options, library, &exit_code] {
    if (options->fit.job.object.empty()) {
      throw CLI::RequiredError("clip and object (or --batch LIST)");
    }
    Run(*options, *library, exit_code);
  });
}

void AddOffhandCommand(CLI::App& app, int& exit_code, const std::shared_ptr<FitLibrary>& library) {
  auto options = std::make_shared<Options>();
  FitCommand& fit = options->fit;
  CLI::App* command = app.add_subcommand(
      "offhand", "Fit an object to a motion in which it passes from hand to hand");
  command->add_option("clip", fit.job.clip, kClipHelp)->required();
  command->add_option("object", fit.job.object, kObjectHelp)->required();
  command
      ->add_option("-o,--output", fit.output,
                   "Output folder: clip.npz, object.ply, metrics.json, report.html")
      ->required();
  fit.job.carry.hand_over = true;
  AddFitOptions(*command, fit, {"hand_over", "hand", "recipe", "drink", "drinking"});
  AddCommonOptions(*command, options->common, true,
                   "  holdfast offhand pass.npz apple -o passed\n"
                   "  holdfast offhand pass.npz ball.obj -o passed_ball --first-hand right "
                   "--switch 60\n");
  command->callback([options, library, &exit_code] { Run(*options, *library, exit_code); });
}

}  // namespace holdfast::apps
