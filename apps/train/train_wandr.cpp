// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include "apps/train/train_command.h"
#include "generator/training/wandr/reach_training.h"
#include "geometry/error.h"

namespace holdfast::apps {
namespace {

using nlohmann::json;

struct TrainWandrCommand : LongTraining {
  std::vector<std::string> corpora;
  std::string held_out, body, wrist = "right";
  double made_hours = 1e6, skating = 0.05;
  Recipe<wandr::TrainingOptions> recipe;

  TrainWandrCommand() {
    evaluate_every = 250;
    recipe.given.prior_share = 0.0;
  }
  Side Wrist() const { return wrist == "right" ? Side::kRight : Side::kLeft; }
};

wandr::TrainingOptions RecipeOf(const TrainWandrCommand& options, const BodyMeasures& measures) {
  wandr::TrainingOptions recipe =
      options.paper ? options.recipe.Over(wandr::PaperOptions()) : options.recipe.given;
  recipe.intention.wrist = options.Wrist();
  recipe.seed = options.common.seed;
  recipe.threads = NumThreads(options.common);
  recipe.goal_losses.skating = static_cast<float>(options.skating);
  const auto height = [&](int joint) {
    return static_cast<float>(measures.rest_joints(1, joint) - measures.sole_y);
  };
  recipe.standing = {height(7), height(10)};
  return recipe;
}

wandr::Corpus ReadMotions(const TrainWandrCommand& options, const BodyMeasures& measures) {
  Progress progress(options.common, "reading clips");
  wandr::CorpusOptions what;
  what.made_hours = options.made_hours;
  what.wrist = options.Wrist();
  return wandr::ReadCorpus({options.corpora.begin(), options.corpora.end()}, measures.rest_joints,
                           what, [&](int done, int total) { progress.Update(done, total); });
}

std::optional<wandr::Corpus> ReadHeldOut(const TrainWandrCommand& options) {
  if (options.held_out.empty()) return std::nullopt;
  wandr::Corpus held_out;
  held_out.clips = wandr::ReadCorpusClips(options.held_out, options.Wrist(), nullptr);
  if (held_out.clips.empty()) {
    throw Error(options.held_out, "holds no clip to validate with",
                "Leave out --held-out, or keep people away with 'make-reach-data --held-out'");
  }
  return held_out;
}

int TrainWandr(const TrainWandrCommand& options) {
  const BodyMeasures measures = MeasureBody(*LoadBody(options.body), Eigen::VectorXd());
  std::filesystem::create_directories(options.output);
  const wandr::Corpus corpus = ReadMotions(options, measures);
  const std::optional<wandr::Corpus> held_out = ReadHeldOut(options);
  std::optional<wandr::NetworkWeights> from;
  if (!options.from.empty()) {
    from = wandr::ReadNetwork(options.from);
    WarnOfOldPelvis(options.from, from->notes, options.common);
  }
  wandr::Trainer trainer(corpus, wandr::BoneOffsetsOf(measures.rest_joints).Cast<float>(),
                         RecipeOf(options, measures), from ? &*from : nullptr);
  TrainingTexts texts;
  texts.network = "wandr";
  texts.notes = {
      fmt::format("{} clips, {:.2f} h captured (with mirror images), {:.2f} h made; "
                  "{:.2f} M parameters",
                  corpus.clips.size(), static_cast<double>(corpus.captured_frames) / 108000.0,
                  static_cast<double>(corpus.made_frames) / 108000.0,
                  static_cast<double>(trainer.NumParameters()) / 1e6)};
  texts.best = [](const json& line) {
    return fmt::format("{:.1f} % of goals reached, {:.1f} cm",
                       100.0 * line["success"].get<double>(),
                       100.0 * line["distance_m"].get<double>());
  };
  texts.evaluation = [&](const json& line) {
    return fmt::format("{}, skating {:.0f} %", texts.best(line),
                       100.0 * line["skating"].get<double>());
  };
  texts.page = WandrTrainingPage;
  return Train(wandr::ReachTraining(trainer, corpus, held_out ? &*held_out : nullptr, measures),
               options, texts);
}

}  // namespace

void AddTrainWandrCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<TrainWandrCommand>();
  using Training = wandr::TrainingOptions;
  Recipe<Training>& recipe = options->recipe;
  CLI::App* command = app.add_subcommand(
      "wandr", "Trains WANDR's c-VAE: motion that walks to goals and reaches for them");
  command->add_option("corpus", options->corpora, "Folders of clips, as of 'make-reach-data'")
      ->required();
  options->AddOutput(*command);
  command->add_option("--held-out", options->held_out,
                      "Folder of clips not trained on, for the curves");
  command->add_option("--from", options->from, "Weights to begin with, with their statistics");
  auto* paper = command->add_flag("--paper", options->paper,
                                  "The published network, features, losses and schedule, where no "
                                  "option says otherwise");
  AddNumber(*command, "--width", recipe.given.width, 16, 4096, "Width of the residual network")
      ->excludes(paper);
  AddNumber(*command, "--blocks", recipe.given.blocks, 1, 64,
            "Blocks of the decoder; the encoder has half as many")
      ->excludes(paper);
  recipe.AddNumber(*command, "--iterations", &Training::iterations, 1, 100'000'000,
                   "Optimizer steps");
  recipe.AddNumber(*command, "--frames", &Training::frames_per_iteration, 64, 1 << 20,
                   "Frames per iteration, unrolled ones counted");
  recipe.Keep(
      AddOption(*command, "--unroll", recipe.given.longest_unroll,
                "Longest rollout in training, frames", CLI::IsMember({1, 2, 4, 8, 16, 32, 64})),
      &Training::longest_unroll);
  recipe.AddNumber(*command, "--learning-rate", &Training::learning_rate, 1e-7, 1.0,
                   "AdamW learning rate");
  recipe.AddNumber(*command, "--kl", &Training::kl_weight, 0.0, 100.0,
                   "Weight of the KL divergence of the latents from N(0, 1)");
  recipe.AddNumber(*command, "--free-from", &Training::free_from, 0.0, 1.0,
                   "Share of the iterations after which full rollouts to goals are trained too");
  recipe.AddNumber(*command, "--free-share", &Training::free_share, 0.0, 1.0,
                   "Share of full rollouts in the iterations after that");
  recipe.AddNumber(*command, "--anchor", &Training::anchor, 0.0, 1e6,
                   "Weight of staying near the earlier network in full rollouts");
  recipe.AddNumber(*command, "--critic", &Training::critic, 0.0, 1e3,
                   "Weight of the adversarial loss");
  recipe.AddNumber(*command, "--prior-share", &Training::prior_share, 0.0, 1.0,
                   "Share of followed windows driven by latents of N(0, 1), not the encoder's");
  AddNumber(*command, "--skating", options->skating, 0.0, 1e3,
            "Weight of sliding feet in full rollouts");
  command
      ->add_option("--made-hours", options->made_hours,
                   "At most this many hours of generated motion")
      ->check(CLI::Range(0.0, 1e6));
  AddOption(*command, "--wrist", options->wrist, "Wrist used for reaching",
            CLI::IsMember({"right", "left"}));
  AddNumber(*command, "--evaluate-every", options->evaluate_every, 1, 1'000'000,
            "Iterations between evaluations");
  command
      ->add_option(
          "--patience", options->patience,
          "Stop after that many iterations without improvement of the success rate [0: never]")
      ->check(CLI::Range(0, 100'000'000));
  command->add_option("--body", options->body, "SMPL-X .npz [the embedded body]");
  AddCommonOptions(
      *command, options->common, true,
      "  holdfast make-reach-data mocap -o reaches --hours 6\n"
      "  holdfast train wandr reaches -o out/wandr --held-out reaches/captured/held_out\n"
      "  holdfast train wandr reaches -o out/paper --paper --iterations 20000\n"
      "  holdfast train wandr reaches -o out/again --from out/wandr/best.safetensors "
      "--iterations 250 --free-from 1\n"
      "  holdfast reach --goal 1.5,1.0,1.1 --weights out/wandr/best.safetensors\n");
  command->callback([options, &exit_code] { exit_code = TrainWandr(*options); });
}

}  // namespace holdfast::apps
