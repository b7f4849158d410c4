// SPDX-License-Identifier: MIT
#include "apps/train/train_imos.h"

#include <chrono>
#include <map>

#include <fmt/format.h>

#include "apps/train/imos_page.h"
#include "apps/train/training_curves.h"
#include "generator/imos/action_set.h"
#include "generator/imos/vocabulary.h"
#include "generator/training/imos/imos_trainer.h"
#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct TrainImosCommand {
  CommonOptions common;
  std::vector<std::string> folders, validation{"s1"}, held_out{"s10"}, drop;
  std::string output, body, from, embeddings, key_frames = "whole";
  bool paper = false, mirror = false;
  bool random_embeddings = false, no_attention = false, one_module = false;
  long iterations = 4000;
  int batch = 64, evaluate_every = 200, patience = 0;
  double learning_rate = 5e-4, dropout = -1.0, present = 0.5, critic = -1.0, noise = 0.02,
         critic_blur_m = 0.01, stance_noise_rad = 0.08;
};

// Lines of training.jsonl: `kind` is train (means since the last line) or rollout (an evaluation).
json LossesJson(const imos::Losses& losses) {
  return {{"arms", losses.arms},         {"body", losses.body},
          {"velocity", losses.velocity}, {"joints", losses.joints},
          {"wrists", losses.wrists},     {"root", losses.root},
          {"total", losses.total},       {"divergence", losses.divergence},
          {"gradient", losses.gradient}, {"doubt", losses.doubt},
          {"critic", losses.critic}};
}

json ErrorsJson(const imos::RolloutErrors& errors) {
  return {{"mpjpe_m", errors.mpjpe_m},
          {"wrists_m", errors.wrists_m},
          {"last_wrist_m", errors.last_wrist_m},
          {"object_m", errors.object_m},
          {"root_m", errors.root_m},
          {"still_m", errors.still_m}};
}

// What those who run the network must know of what it was trained on: {"drink": 0.21, ...} seconds
// per key frame, and {"drink": {"mug": 12, ...}, ...} sequences.
std::map<std::string, std::string> DataNotes(const imos::ActionSet& set) {
  std::map<std::string, double> seconds;
  std::map<std::string, int> counts;
  std::map<std::string, std::map<std::string, int>> seen;
  for (const imos::ActionSequence& sequence : set.train) {
    if (sequence.mirrored) continue;
    const std::string action(imos::Actions()[sequence.action].label);
    seconds[action] += sequence.seconds_per_key_frame;
    ++counts[action];
    ++seen[action][std::string(imos::Objects()[sequence.object])];
  }
  for (auto& [action, sum] : seconds) sum /= counts[action];
  return {{"seconds_per_key_frame", json(seconds).dump()}, {"seen", json(seen).dump()}};
}

class ImosTraining {
 public:
  explicit ImosTraining(const TrainImosCommand& options)
      : options_(options), folder_(options.output) {}

  int Run();

 private:
  imos::TrainingOptions Recipe() const;
  imos::ActionSet Read() const;
  json Evaluate(const imos::Trainer& trainer) const;
  void Keep(const imos::Trainer& trainer, const json& line, const std::string& name) const;
  void WriteLog() const;
  void Loop(imos::Trainer& trainer);
  int Summarise(const imos::Trainer& trainer) const;
  // Whether an evaluation is to be kept as the best. With a critic the last one is: a distance to
  // what truly happened is least for the mean of what may happen.
  bool IsBetter(const json& line) const {
    return best_.is_null() || has_critic_ || Score(line) <= Score(best_);
  }
  // How good an evaluation is: less is better.
  static double Score(const json& line) {
    return line.contains("validation") ? line["validation"]["mpjpe_m"].get<double>()
                                       : line["train"]["mpjpe_m"].get<double>();
  }

  const TrainImosCommand& options_;
  fs::path folder_;
  imos::ActionSet set_;
  std::vector<imos::ActionSequence> some_trained_;  // to compare with those that are not
  std::vector<json> lines_;
  json best_;
  bool has_critic_ = false;
};

imos::TrainingOptions ImosTraining::Recipe() const {
  imos::TrainingOptions recipe = options_.paper ? imos::PaperOptions() : imos::TrainingOptions();
  imos::Config& config = recipe.config;
  if (!options_.embeddings.empty()) {
    config.action_embedding = imos::ActionEmbedding::kGiven;
    config.action_size = 512;
  } else if (options_.paper) {
    config.action_embedding = imos::ActionEmbedding::kLearned;
  }
  if (options_.random_embeddings) config.action_embedding = imos::ActionEmbedding::kRandom;
  if (options_.no_attention) config.self_attention = false;
  if (options_.one_module) config.modules = imos::Modules::kOne;
  recipe.iterations = options_.iterations;
  recipe.batch = options_.batch;
  recipe.learning_rate = options_.learning_rate;
  recipe.present_share = options_.present;
  if (options_.dropout >= 0.0) recipe.dropout = options_.dropout;
  if (!options_.paper) {
    recipe.history_noise = options_.noise;
    if (options_.critic >= 0.0) recipe.critic = options_.critic;
    recipe.critic_blur_m = options_.critic_blur_m;
    recipe.stance_noise_rad = options_.stance_noise_rad;
    // Weights that can walk already need not learn it step by step.
    if (!options_.from.empty())
      recipe.lengthen_until = recipe.running_from = recipe.critic_from = 0.0;
  }
  recipe.seed = options_.common.seed;
  recipe.threads = NumThreads(options_.common);
  return recipe;
}

imos::ActionSet ImosTraining::Read() const {
  Progress progress(options_.common, "reading clips");
  imos::ActionSetOptions what;
  what.sequences.rule =
      options_.key_frames == "paper" ? imos::KeyFrameRule::kPaper : imos::KeyFrameRule::kWhole;
  what.split = {options_.validation, options_.held_out};
  what.without = options_.drop;
  what.threads = NumThreads(options_.common);
  const std::vector<fs::path> folders(options_.folders.begin(), options_.folders.end());
  imos::ActionSet set =
      imos::ReadActionSet(folders, LoadBody(options_.body), what,
                          [&](int done, int total) { progress.Update(done, total); });
  if (set.train.empty()) {
    throw Error(folders.front().string(), "all subjects are held out or for validation",
                "Name fewer with --held-out and --validation");
  }
  if (options_.mirror) {
    const std::size_t count = set.train.size();
    for (std::size_t k = 0; k < count; ++k) set.train.push_back(imos::Mirrored(set.train[k]));
  }
  return set;
}

json ImosTraining::Evaluate(const imos::Trainer& trainer) const {
  json line{{"kind", "rollout"},
            {"iteration", trainer.Iteration()},
            {"train", ErrorsJson(trainer.Evaluate(some_trained_))}};
  if (!set_.validation.empty()) line["validation"] = ErrorsJson(trainer.Evaluate(set_.validation));
  return line;
}

// <name>.safetensors with all that training needs, <name>_half.safetensors to be shipped.
void ImosTraining::Keep(const imos::Trainer& trainer, const json& line,
                        const std::string& name) const {
  imos::NetworkWeights weights = trainer.Weights(true);
  weights.notes = DataNotes(set_);
  weights.notes["made_by"] = "holdfast train imos " HOLDFAST_VERSION;
  weights.notes["iteration"] = std::to_string(trainer.Iteration());
  weights.notes["key_frames"] = options_.key_frames;
  weights.notes["data"] = fmt::format(
      "{} sequences{}, {} to validate, {} held out", set_.train.size(),
      options_.mirror ? " (mirror images counted)" : "", set_.validation.size(), set_.test.size());
  weights.notes["validation"] = line.dump();
  imos::WriteNetwork(weights, folder_ / (name + ".safetensors"));
  imos::WriteNetwork(imos::WithoutTraining(std::move(weights)),
                     folder_ / (name + "_half.safetensors"), true);
}

void ImosTraining::WriteLog() const {
  std::string text;
  for (const json& line : lines_) text += line.dump() + "\n";
  WriteAtomically(folder_ / "training.jsonl", text);
  WriteAtomically(folder_ / "train.html", ImosTrainingPage(lines_, options_.iterations));
}

void ImosTraining::Loop(imos::Trainer& trainer) {
  const fs::path checkpoint = folder_ / "checkpoint.safetensors";
  Progress progress(options_.common, "iterations");
  imos::Losses sum;
  int summed = 0;
  auto saved = std::chrono::steady_clock::now();
  const auto began = saved;
  const long first = trainer.Iteration();
  while (trainer.Iteration() < options_.iterations && !Interrupted()) {
    const double rate = trainer.LearningRate();
    sum.Add(trainer.Step(), 1.0);
    ++summed;
    const long iteration = trainer.Iteration();
    progress.Update(static_cast<int>(iteration - first),
                    static_cast<int>(options_.iterations - first));
    const bool last = iteration == options_.iterations;
    if (iteration % 50 == 0 || last) {
      const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - began;
      imos::Losses mean;
      mean.Add(sum, 1.0 / summed);
      json line = LossesJson(mean);
      line["kind"] = "train";
      line["iteration"] = iteration;
      line["learning_rate"] = rate;
      line["seconds"] = passed.count();
      lines_.push_back(line);
      sum = {};
      summed = 0;
    }
    if (iteration % options_.evaluate_every == 0 || last) {
      lines_.push_back(Evaluate(trainer));
      const json& now = lines_.back();
      const json& errors = now.contains("validation") ? now["validation"] : now["train"];
      Note(options_.common,
           fmt::format("iteration {}: joints {:.2f} cm (still: {:.2f}), wrist {:.2f} cm, object "
                       "{:.2f} cm",
                       iteration, 100.0 * errors["mpjpe_m"].get<double>(),
                       100.0 * errors["still_m"].get<double>(),
                       100.0 * errors["wrists_m"].get<double>(),
                       100.0 * errors["object_m"].get<double>()));
      if (IsBetter(now)) {
        best_ = now;
        Keep(trainer, best_, "best");
      }
      Keep(trainer, now, "latest");
      WriteLog();
      if (options_.patience > 0 &&
          iteration - best_["iteration"].get<long>() >= options_.patience) {
        break;
      }
    }
    if (std::chrono::steady_clock::now() - saved > std::chrono::minutes(2) || last) {
      trainer.Save(checkpoint);
      saved = std::chrono::steady_clock::now();
    }
  }
  trainer.Save(checkpoint);
  WriteLog();
}

int ImosTraining::Summarise(const imos::Trainer& trainer) const {
  json summary = JsonHead("holdfast/train-imos/1", options_.common);
  summary["iterations"] = trainer.Iteration();
  summary["parameters"] = trainer.NumParameters();
  summary["sequences"] = {{"train", set_.train.size()},
                          {"validation", set_.validation.size()},
                          {"held_out", set_.test.size()}};
  summary["best"] = best_;
  const std::string best = best_.is_null()
                               ? "not evaluated yet"
                               : fmt::format("joints {:.2f} cm off (iteration {})",
                                             100.0 * Score(best_), best_["iteration"].get<long>());
  PrintResult(options_.common, summary,
              fmt::format("{}: {} iterations\n  best    {}\n  curves  {}\n",
                          (folder_ / "best.safetensors").string(), trainer.Iteration(), best,
                          (folder_ / "train.html").string()));
  if (!Interrupted()) return kDone;
  Note(options_.common, "interrupted: the same command goes on from here");
  return kInterrupted;
}

int ImosTraining::Run() {
  const fs::path checkpoint = folder_ / "checkpoint.safetensors";
  const bool goes_on = fs::exists(checkpoint) && !options_.common.force;
  set_ = Read();
  const std::size_t step = std::max<std::size_t>(1, set_.train.size() / 100);
  for (std::size_t k = 0; k < set_.train.size(); k += step) some_trained_.push_back(set_.train[k]);
  const imos::TrainingOptions recipe = Recipe();
  has_critic_ = recipe.critic > 0.0;
  Eigen::MatrixXf embeddings;
  if (!options_.embeddings.empty()) {
    embeddings = imos::ReadActionTable(options_.embeddings, recipe.config.action_size);
  }
  imos::Trainer trainer(set_.train, recipe, embeddings);
  if (!options_.from.empty()) trainer.StartFrom(imos::ReadNetwork(options_.from), options_.from);
  if (goes_on) {
    trainer.Load(checkpoint);
    lines_ = LinesBefore(folder_ / "training.jsonl", trainer.Iteration());
    for (const json& line : lines_) {
      if (line.value("kind", "") != "rollout") continue;
      if (IsBetter(line)) best_ = line;
    }
    Note(options_.common, fmt::format("going on after iteration {}", trainer.Iteration()));
  }
  fs::create_directories(folder_);
  for (std::size_t k = 0; k < set_.notes.size() && k < 5; ++k) {
    Note(options_.common, "left out: " + set_.notes[k]);
  }
  if (set_.notes.size() > 5) {
    Note(options_.common, fmt::format("left out: {} more", set_.notes.size() - 5));
  }
  Note(options_.common,
       fmt::format("{} sequences to train on, {} to validate, {} held out; {:.2f} M parameters; {} "
                   "batches an epoch",
                   set_.train.size(), set_.validation.size(), set_.test.size(),
                   static_cast<double>(trainer.NumParameters()) / 1e6, trainer.BatchesPerEpoch()));
  Loop(trainer);
  return Summarise(trainer);
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
  CLI::App* command =
      app.add_subcommand("imos", "Trains IMoS's c-VAEs: actions with objects, from an intent");
  command
      ->add_option("folders", options->folders,
                   "Folders of clips with objects, of 'make-actions' or imported from GRAB")
      ->required();
  command
      ->add_option(
          "-o,--output", options->output,
          "Folder: best.safetensors, checkpoint, curves (train.html); resumed if it exists")
      ->required();
  auto* paper = command->add_flag("--paper", options->paper,
                                  "The published networks, losses, schedule and key frames; 'lift' "
                                  "is left out");
  command->add_option("--held-out", options->held_out, "Subjects kept for tests: not read")
      ->delimiter(',')
      ->capture_default_str();
  command->add_option("--validation", options->validation, "Subjects for the curves")
      ->delimiter(',')
      ->capture_default_str();
  auto* drop = command->add_option("--drop", options->drop, "Actions to leave out")->delimiter(',');
  auto* rule = command
                   ->add_option("--key-frames", options->key_frames,
                                "whole: 15 over the clip; paper: the first 15 twentieths of the "
                                "contact with the object")
                   ->check(CLI::IsMember({"whole", "paper"}))
                   ->capture_default_str();
  command->add_flag("--mirror", options->mirror, "Add the mirror image of every sequence");
  AddAblations(*command, *options);
  command->add_option("--iterations", options->iterations, "Batches")
      ->capture_default_str()
      ->check(CLI::Range(1l, 100'000'000l));
  command->add_option("--batch", options->batch, "Sequences of one batch")
      ->capture_default_str()
      ->check(CLI::Range(2, 65536));
  auto* rate = command->add_option("--learning-rate", options->learning_rate, "Adam learning rate")
                   ->capture_default_str()
                   ->check(CLI::Range(1e-7, 1.0));
  command
      ->add_option("--dropout", options->dropout,
                   "Dropout in blocks and attention [0; --paper: 0.1]")
      ->check(CLI::Range(0.0, 0.9));
  command
      ->add_option("--present-share", options->present,
                   "Of sequences whose arms are driven by the encoder that sees the answer")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1.0));
  command
      ->add_option("--critic", options->critic,
                   "Weight of the adversarial loss on whole motions, from half of the iterations "
                   "on; 0: none [0.06; --paper: none]")
      ->check(CLI::Range(0.0, 1000.0));
  command
      ->add_option(
          "--critic-blur", options->critic_blur_m,
          "Noise on the discriminator's input, metres: hides tremor, so that it judges the action")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 0.2));
  command
      ->add_option(
          "--from", options->from,
          "best.safetensors of an earlier training to begin with: more iterations, or other data")
      ->check(CLI::ExistingFile);
  command
      ->add_option(
          "--stance-noise", options->stance_noise_rad,
          "Noise on the stance, the same in all of a sequence, radians [0.08; --paper: none]")
      ->check(CLI::Range(0.0, 1.0));
  command->add_option("--noise", options->noise, "Noise on given histories, in 6D")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1.0));
  command->add_option("--evaluate-every", options->evaluate_every, "Batches between evaluations")
      ->capture_default_str()
      ->check(CLI::Range(1, 1'000'000));
  command
      ->add_option("--patience", options->patience,
                   "Stop after that many batches without improvement [0: never]")
      ->check(CLI::Range(0, 100'000'000));
  command->add_option("--body", options->body, "SMPL-X .npz [the embedded body]");
  AddCommonOptions(*command, options->common, true,
                   "  holdfast train imos actions -o out/imos --held-out s9,s10\n"
                   "  holdfast train imos grab_clips -o out/paper --paper --iterations 20000 \\\n"
                   "      --action-embeddings clip_embeddings.npz --body SMPLX_NEUTRAL.npz\n"
                   "  holdfast synthesize --action drink --object mug "
                   "--weights out/imos/best.safetensors\n");
  command->callback([=, &exit_code] {
    if (*paper) {
      if (rule->count() == 0) options->key_frames = "paper";
      if (drop->count() == 0) options->drop = {"lift"};
      if (rate->count() == 0) options->learning_rate = imos::PaperOptions().learning_rate;
    }
    exit_code = ImosTraining(*options).Run();
  });
}

}  // namespace holdfast::apps
