// SPDX-License-Identifier: MIT
#include "apps/common.h"
#include "apps/motion/reach_job.h"
#include "apps/reach_network.h"

namespace holdfast::apps {
namespace {

// A goal that moves. What plans a whole motion makes no sense with it.
void AddTrackOptions(CLI::App& command, CLI::Option& goal, ReachCommand& reach) {
  CLI::Option* track =
      command
          .add_option("--track", reach.track,
                      "Table of goals (x,y,z or time,x,y,z a line): one a frame, followed without "
                      "looking ahead, 30 a second")
          ->excludes(&goal);
  command
      .add_option(
          "--rate", reach.rate_hz,
          "Goals a second in the table [30, or by its times]; a frame has the one that came "
          "last")
      ->check(CLI::Range(0.1, 10'000.0))
      ->needs(track);
  command
      .add_option("--push", reach.pushes,
                  "FRAME,DX,DY,DZ: something moves the body by so many metres from that goal on, "
                  "within 0.3 s. Repeated: several")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->needs(track);
}

}  // namespace

void AddReachCommand(CLI::App& app, int& exit_code) {
  struct Options {
    CommonOptions common;
    ReachCommand reach;
  };
  auto options = std::make_shared<Options>();
  ReachCommand& reach = options->reach;
  CLI::App* command =
      app.add_subcommand("reach", "Generate a person who walks to a goal and reaches for it");
  CLI::Option* goal =
      command
          ->add_option("--goal", reach.goals,
                       "X,Y,Z of the wrist, metres, z up from the ground. Repeated: one after "
                       "another in one motion")
          ->expected(1)
          ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  AddTrackOptions(*command, *goal, reach);
  command->add_option(
      "--from", reach.from,
      "CLIP or CLIP:FRAME to continue from (the last frame if left out). Without it a "
      "person stands at the origin, facing -y");
  AddOptions(*command, OptionsOf(reach.job).Without({"grasp", "refit_all", "object_scale",
                                                   "object_yaw_deg"}));
  command
      ->add_option("--obstacle", reach.obstacles,
                   "Mesh to keep out of, as it stands in the world (latent-opt). Repeated: several")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  command
      ->add_option("--approach", reach.approach,
                   "X,Y,Z along the forearm, elbow to wrist, on arrival (latent-opt)")
      ->excludes(command->get_option("--free-time"));
  CLI::Option* object = command->add_option(
      "--object", reach.object,
      "Mesh or embedded object that stands on a table at the first --goal (the middle of its "
      "bottom) and is carried to the others. Needs --grasp");
  command
      ->add_option("--grasp", reach.grasp,
                   "Take the object: by a power, precision or handle grasp, or whichever is best")
      ->expected(0, 1)
      ->default_str("auto")
      ->check(CLI::IsMember({"auto", "power", "precision", "handle"}))
      ->needs(object);
  object->needs(command->get_option("--grasp"));
  AddOptions(*command, OptionsOf(reach.job).Only({"object_yaw_deg", "object_scale"}));
  command->get_option("--object-yaw")->needs(object);
  command->get_option("--object-scale")->needs(object);
  command->add_flag("--all", reach.all, "Keep all samples: samples/NN.npz, best first");
  command->add_option("--body", reach.body, "Body model in place of the embedded one");
  AddWeightsOption(*command, reach.weights);
  command->add_flag_callback(
      "--no-report", [&out = reach.write_report] { out = false; }, "Leave out report.html");
  for (const char* planned :
       {"--time", "--method", "--samples", "--obstacle", "--free-time", "--approach", "--no-refit",
        "--object", "--optimizer", "--iterations", "--prior-weight", "--all", "--sigma"}) {
    command->get_option("--track")->excludes(command->get_option(planned));
  }
  AddOption(*command, "-o,--output", reach.output,
            "Folder to make: clip.npz, metrics.json, report.html");
  AddCommonOptions(
      *command, options->common, true,
      "  holdfast reach --goal 1.5,1.0,1.1\n"
      "  holdfast reach --goal 0.4,-2.0,0.9 --goal -1.0,-2.5,1.4 --samples 64 -o errand\n"
      "  holdfast reach --goal 3,1,1.2 --method latent-opt -o precise\n"
      "  holdfast reach --from walk.npz:40 --goal 2.0,0.5,0.3 --wrist left --all -o reached\n"
      "  holdfast reach --goal 1.5,1,0.8 --goal -0.5,1.5,1.1 --object mug --grasp -o taken\n"
      "  holdfast reach --track goals.csv --push 90,0.2,0,0 -o followed\n"
      "A goal is reached when the wrist is within 10 cm of it. The next is taken on when the\n"
      "wrist has been there and comes no closer, or half as long again after the goal was due\n"
      "(twice that while the wrist still comes closer). What no sample reaches is tried once\n"
      "more with half as much time again. The best sample: most goals reached; then no second\n"
      "crouch on the way; then, of those that reach all, the one that moves most as people do\n"
      "(speed, turns, lean, height of the pelvis, joint limits, accelerations), of others the\n"
      "least sum of closest distances.\n");
  command->callback([options, &exit_code] {
    if (options->reach.goals.empty() && options->reach.track.empty()) {
      throw CLI::RequiredError("--goal or --track");
    }
    const Outcome outcome = RunReach(options->reach, options->common);
    if (!outcome.summary.is_null()) PrintResult(options->common, outcome.summary, outcome.text);
    exit_code = outcome.exit_code;
  });
}

}  // namespace holdfast::apps
