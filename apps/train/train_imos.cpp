// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include "apps/train/train_command.h"
#include "generator/training/imos/action_training.h"
#include "geometry/error.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct TrainImosCommand : LongTraining {
  ActionClips clips;
  std::string embeddings;
  bool mirror = false, random_embeddings = false, no_attention = false, one_module = false;
  Recipe<imos::TrainingOptions> recipe;
};

imos::TrainingOptions RecipeOf(const TrainImosCommand& options) {
  imos::TrainingOptions recipe =
      options.paper ? options.recipe.Over(imos::PaperOptions()) : options.recipe.given;
  if (!options.paper && !options.from.empty()) {
    // Weights that can walk already need not learn it step by step.
    recipe.lengthen_until = recipe.running_from = recipe.critic_from = 0.0;
  }
  imos::Config& config = recipe.config;
  if (!options.embeddings.empty()) {
    config.action_embedding = imos::ActionEmbedding::kGiven;
    config.action_size = 512;
  } else if (options.paper) {
    config.action_embedding = imos::ActionEmbedding::kLearned;
  }
  if (options.random_embeddings) config.action_embedding = imos::ActionEmbedding::kRandom;
  if (options.no_attention) config.self_attention = false;
  if (options.one_module) config.modules = imos::Modules::kOne;
  recipe.seed = options.common.seed;
  recipe.threads = NumThreads(options.common);
  return recipe;
}

imos::ActionSet ReadSequences(const TrainImosCommand& options) {
  imos::ActionSet set = options.clips.Read(options.common);
  if (set.train.empty()) {
    throw Error(fs::path(options.clips.folders.front()).string(),
                "all subjects are held out or for validation",
                "Name fewer with --held-out and --validation");
  }
  if (options.mirror) {
    const std::size_t count = set.train.size();
    for (std::size_t k = 0; k < count; ++k) set.train.push_back(imos::Mirrored(set.train[k]));
  }
  return set;
}

int TrainImos(const TrainImosCommand& options) {
  const imos::ActionSet set = ReadSequences(options);
  const imos::TrainingOptions recipe = RecipeOf(options);
  Eigen::MatrixXf embeddings;
  if (!options.embeddings.empty()) {
    embeddings = imos::ReadActionTable(options.embeddings, recipe.config.action_size);
  }
  imos::Trainer trainer(set.train, recipe, embeddings);
  if (!options.from.empty()) {
    const imos::NetworkWeights from = imos::ReadNetwork(options.from);
    WarnOfOldPelvis(options.from, from.notes, options.common);
    trainer.StartFrom(from, options.from);
  }
  TrainingTexts texts;
  texts.network = "imos";
  texts.kept["key_frames"] = options.clips.key_frames;
  for (std::size_t k = 0; k < set.notes.size() && k < 5; ++k) {
    texts.notes.push_back("left out: " + set.notes[k]);
  }
  if (set.notes.size() > 5) {
    texts.notes.push_back(fmt::format("left out: {} more", set.notes.size() - 5));
  }
  texts.notes.push_back(
      fmt::format("{} sequences to train on, {} to validate, {} held out; {:.2f} M parameters; {} "
                  "batches an epoch",
                  set.train.size(), set.validation.size(), set.test.size(),
                  static_cast<double>(trainer.NumParameters()) / 1e6, trainer.BatchesPerEpoch()));
  texts.summary["parameters"] = trainer.NumParameters();
  texts.summary["sequences"] = {{"train", set.train.size()},
                                {"validation", set.validation.size()},
                                {"held_out", set.test.size()}};
  const auto cm = [](const json& line, const char* error) {
    return 100.0 * imos::ErrorsOf(line)[error].get<double>();
  };
  texts.evaluation = [&](const json& line) {
    return fmt::format("joints {:.2f} cm (still: {:.2f}), wrist {:.2f} cm, object {:.2f} cm",
                       cm(line, "mpjpe_m"), cm(line, "still_m"), cm(line, "wrists_m"),
                       cm(line, "object_m"));
  };
  texts.best = [&](const json& line) {
    return fmt::format("joints {:.2f} cm off", cm(line, "mpjpe_m"));
  };
  texts.page = ImosTrainingPage;
  return Train(imos::ActionTraining(trainer, set), options, texts);
}

void AddAblations(CLI::App& command, TrainImosCommand& options) {
  auto* random = command.add_flag("--random-embeddings", options.random_embeddings,
                                  "Fixed random vectors for actions (the paper's first ablation)");
  command.add_flag("--no-attention", options.no_attention,
                   "Past poses as they are (the second ablation)");
  command.add_flag("--one-module", options.one_module,
                   "One network for arms and body (the third ablation)");
  command
      .add_option("--action-embeddings", options.embeddings,
                  "512 numbers for each of the 29 labels (.npz, .safetensors) [learned]")
      ->check(CLI::ExistingFile)
      ->excludes(random);
}

}  // namespace

void AddTrainImosCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<TrainImosCommand>();
  using Training = imos::TrainingOptions;
  Recipe<Training>& recipe = options->recipe;
  CLI::App* command =
      app.add_subcommand("imos", "Trains IMoS's c-VAEs: actions with objects, from an intent");
  command
      ->add_option("folders", options->clips.folders,
                   "Folders of clips with objects, of 'make-actions' or imported from GRAB")
      ->required();
  options->AddOutput(*command);
  auto* paper = command->add_flag("--paper", options->paper,
                                  "The published networks, losses, schedule and key frames, 'lift' "
                                  "left out, where no option says otherwise");
  AddList(*command, "--held-out", options->clips.held_out, "Subjects kept for tests: not read");
  AddList(*command, "--validation", options->clips.validation, "Subjects for the curves");
  auto* drop =
      command->add_option("--drop", options->clips.without, "Actions to leave out")->delimiter(',');
  auto* rule = command
                   ->add_option("--key-frames", options->clips.key_frames,
                                "whole: 15 over the clip; paper: the first 15 twentieths of the "
                                "contact with the object")
                   ->check(CLI::IsMember({"whole", "paper"}))
                   ->capture_default_str();
  command->add_flag("--mirror", options->mirror, "Add the mirror image of every sequence");
  AddAblations(*command, *options);
  recipe.AddNumber(*command, "--iterations", &Training::iterations, 1, 100'000'000, "Batches");
  recipe.AddNumber(*command, "--batch", &Training::batch, 2, 65536, "Sequences of one batch");
  recipe.AddNumber(*command, "--learning-rate", &Training::learning_rate, 1e-7, 1.0,
                   "Adam learning rate");
  recipe.Keep(command
                  ->add_option("--dropout", recipe.given.dropout,
                               "Dropout in blocks and attention [0; --paper: 0.1]")
                  ->check(CLI::Range(0.0, 0.9)),
              &Training::dropout);
  recipe.AddNumber(*command, "--present-share", &Training::present_share, 0.0, 1.0,
                   "Of sequences whose arms are driven by the encoder that sees the answer");
  command
      ->add_option("--critic", recipe.given.critic,
                   "Weight of the adversarial loss on whole motions, from half of the iterations "
                   "on; 0: none [0.06]")
      ->check(CLI::Range(0.0, 1000.0))
      ->excludes(paper);
  AddNumber(
      *command, "--critic-blur", recipe.given.critic_blur_m, 0.0, 0.2,
      "Noise on the discriminator's input, meters: hides tremor, so that it judges the action")
      ->excludes(paper);
  command
      ->add_option(
          "--from", options->from,
          "best.safetensors of an earlier training to begin with: more iterations, or other data")
      ->check(CLI::ExistingFile);
  command
      ->add_option("--stance-noise", recipe.given.stance_noise_rad,
                   "Noise on the stance, the same in all of a sequence, radians [0.08]")
      ->check(CLI::Range(0.0, 1.0))
      ->excludes(paper);
  recipe.Keep(command
                  ->add_option("--noise", recipe.given.history_noise,
                               "Noise on given histories, in 6D [0.02; --paper: none]")
                  ->check(CLI::Range(0.0, 1.0)),
              &Training::history_noise);
  AddNumber(*command, "--evaluate-every", options->evaluate_every, 1, 1'000'000,
            "Batches between evaluations");
  command
      ->add_option("--patience", options->patience,
                   "Stop after that many batches without improvement [0: never]")
      ->check(CLI::Range(0, 100'000'000));
  command->add_option("--body", options->clips.body, "SMPL-X .npz [the embedded body]");
  AddCommonOptions(*command, options->common, true,
                   "  holdfast train imos actions -o out/imos --held-out s9,s10\n"
                   "  holdfast train imos grab_clips -o out/paper --paper --iterations 20000 \\\n"
                   "      --action-embeddings clip_embeddings.npz --body SMPLX_NEUTRAL.npz\n"
                   "  holdfast synthesize --action drink --object mug "
                   "--weights out/imos/best.safetensors\n");
  command->callback([=, &exit_code] {
    if (*paper) {
      if (rule->count() == 0) options->clips.key_frames = "paper";
      if (drop->count() == 0) options->clips.without = {"lift"};
    }
    exit_code = TrainImos(*options);
  });
}

}  // namespace holdfast::apps
