// SPDX-License-Identifier: MIT
#include <optional>

#include <fmt/format.h>

#include "apps/clip_input.h"
#include "apps/common.h"
#include "generator/wandr/network.h"
#include "solver/body_ik/make_reach_data.h"
#include "solver/reach/optimized_reaches.h"

namespace holdfast::apps {
namespace {

using nlohmann::json;

struct MakeReachDataCommand {
  CommonOptions common;
  ReachDataOptions data;
  std::string captures, output, body;
  std::string wrist = "right";
  std::vector<std::string> held_out;
  int optimized = 0;
  std::string weights;
};

// Generates reaches by latent optimization, in addition to the others.
OptimizedReachesReport MakeOptimized(const MakeReachDataCommand& options, const CaptureSet& set,
                                     const BodyModel& body, const ReachNetwork& network,
                                     const StagedProgress& tell) {
  OptimizedReachesOptions optimized;
  optimized.count = options.optimized;
  optimized.seed = options.common.seed;
  optimized.threads = NumThreads(options.common);
  optimized.replace = options.common.force;
  optimized.version = HOLDFAST_VERSION;
  optimized.network = network.checksum;
  return MakeOptimizedReaches(set, body, network.weights, optimized,
                              std::filesystem::path(options.output) / "optimized", tell);
}

int Run(MakeReachDataCommand options) {
  const CommonOptions& common = options.common;
  ReachDataOptions& data = options.data;
  data.wrists = options.wrist == "right"  ? ReachWrists::kRight
                : options.wrist == "left" ? ReachWrists::kLeft
                                          : ReachWrists::kBoth;
  data.seed = common.seed;
  data.threads = NumThreads(common);
  data.replace = common.force;
  data.version = HOLDFAST_VERSION;
  const std::filesystem::path folder = options.output;
  const auto body = LoadBody(options.body);
  std::optional<ReachNetwork> network;  // loaded first, so that errors come early
  if (options.optimized > 0) network = LoadReachNetwork(options.weights, common);
  StageProgress progress(common);
  const auto tell = [&](const char* stage, int done, int total) {
    progress.Update(stage, done, total);
    return !Interrupted();
  };
  const std::optional<CaptureSet> captured = ImportCaptures(
      options.captures, folder / "captured", *body, options.held_out, data.threads, tell);
  progress.End();
  if (!captured) return kInterrupted;
  Note(common, fmt::format("{} captured clips ({:.1f} min for training, {:.1f} min held out), {} "
                           "dropped; {} source reaches",
                           captured->captures.size(), captured->train_minutes,
                           captured->held_out_minutes, captured->dropped, captured->reach_sources));
  ReachDataReport made = MakeReachData(*captured, data, folder, tell);
  if (made.stopped) return kInterrupted;
  if (made.minutes < 60.0 * data.hours) {
    throw FitFailure(fmt::format(
        "only {:.1f} of {:.1f} minutes after {} clips: nearly all clips are dropped, see {}",
        made.minutes, 60.0 * data.hours, made.tried, (folder / "manifest.json").string()));
  }
  std::string optimized_text;
  if (network) {
    const OptimizedReachesReport optimized =
        MakeOptimized(options, *captured, *body, *network, tell);
    progress.End();
    if (optimized.stopped) return kInterrupted;
    made.head["optimized"] = {{"clips", optimized.kept},
                              {"clips_dropped", optimized.dropped},
                              {"minutes", optimized.minutes}};
    optimized_text = fmt::format("optimized: {:.1f} minutes in {} clips ({} dropped)\n",
                                 optimized.minutes, optimized.kept, optimized.dropped);
  }
  made.head.erase("captures");
  made.head["output"] = options.output;
  const json& summary = made.head["summary"];
  PrintResult(
      common, made.head,
      fmt::format("{}: {:.2f} hours in {} clips ({} dropped, {} existed already), {} goals, {} "
                  "while carrying\n",
                  options.output, summary["hours"].get<double>(), summary["clips"].get<int>(),
                  summary["clips_dropped"].get<int>(), made.had, summary["goals"].get<int>(),
                  summary["goals_carried"].get<int>()) +
          optimized_text);
  return kDone;
}

}  // namespace

void AddMakeReachDataCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<MakeReachDataCommand>();
  CLI::App* command = app.add_subcommand(
      "make-reach-data", "Generate walking, turning and reaching with goals from captured clips");
  command
      ->add_option("captures", options->captures,
                   "Folder of captured motion (.bvh .amc .npz, .gz), with an optional index.csv")
      ->required();
  command
      ->add_option("-o,--output", options->output,
                   "Output folder: captured/, made/, optimized/, manifest.json; an unfinished one "
                   "is resumed")
      ->required();
  AddOption(*command, "--hours", options->data.hours, "Hours of motion to generate",
            CLI::Range(0.01, 200.0));
  command
      ->add_option("--held-out", options->held_out,
                   "Subjects or clip names (folder_file) to hold out from training [the subjects "
                   "with the fewest frames, up to a tenth of all frames]")
      ->delimiter(',');
  AddOption(*command, "--wrist", options->wrist, "Wrist used for reaching",
            CLI::IsMember({"right", "left", "both"}));
  AddOption(*command, "--reaches", options->data.reaches, "Number of consecutive goals in a clip",
            CLI::Range(1, 100));
  AddOption(*command, "--farthest", options->data.farthest_m, "Maximum distance to a goal, meters",
            CLI::Range(0.5, 20.0));
  AddOption(*command, "--pace", options->data.pace,
            "Multiplies the walking speed (1.0-1.8 m/s) and the playback speed (1.0-1.35 times as "
            "captured); below 1: slower",
            CLI::Range(0.6, 1.3));
  AddOption(*command, "--blend", options->data.blend_s,
            "Duration of a transition between captured segments, seconds", CLI::Range(0.1, 1.0));
  command->add_flag("--as-captured", options->data.as_captured,
                    "Keep reaches as captured: goals are where the wrists arrive");
  CLI::Option* const optimized =
      AddOption(*command, "--optimized", options->optimized,
                "Number of additional reaches to attempt by optimizing the latents of a trained "
                "network, written to optimized/; for distillation with 'train wandr --from'",
                CLI::Range(0, 1000000));
  command
      ->add_option("--weights", options->weights,
                   "Network (.safetensors) for --optimized [the embedded one]")
      ->needs(optimized);
  command->add_option("--body", options->body, "Body model: SMPL-X .npz [the embedded body]");
  AddCommonOptions(*command, options->common, true,
                   "  holdfast make-reach-data mocap -o reaches --hours 4\n"
                   "  holdfast make-reach-data mocap -o reaches --hours 4 --optimized 800\n"
                   "  holdfast make-reach-data mocap -o left --hours 0.5 --wrist left --seed 7 "
                   "--held-out cmu_08,cmu_39\n"
                   "made/*.npz are clips with arrays goal (K x 3, world, meters), goal_frame (K) "
                   "and goal_wrist (K):\n"
                   "the wrist joint is at the goal in its goal_frame. A goal becomes current when "
                   "the previous one is\n"
                   "reached.\n");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace holdfast::apps
