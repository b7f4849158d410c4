// SPDX-License-Identifier: MIT
#include "apps/train/train_wandr.h"

#include <chrono>

#include <fmt/format.h>

#include "apps/train/training_curves.h"
#include "apps/train/training_page.h"
#include "generator/scripted/reach_motion.h"
#include "generator/training/wandr/trainer.h"
#include "generator/wandr/reach_protocol.h"
#include "generator/wandr/reach_starts.h"
#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/read_json.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct TrainWandrCommand {
  CommonOptions common;
  std::vector<std::string> corpora;
  std::string output, held_out, body, from, wrist = "right";
  bool paper = false;
  int width = 256, blocks = 4, unroll = 16, frames = 4096;
  long iterations = 6000;
  double made_hours = 1e6, learning_rate = 6e-4, kl = 0.5;
  double free_from = 0.5, free_share = 0.5, anchor = 1.0, skating = 0.05, critic = 1.0, prior = 0.0;
  int evaluate_every = 250, patience = 0;
};

// Lines of training.jsonl: `kind` is train (means since the last line) or reach (an evaluation).
json LossesJson(const wandr::TrainingLosses& losses) {
  return {{"translation", losses.translation},
          {"orientation", losses.orientation},
          {"pose", losses.pose},
          {"kl", losses.kl},
          {"joints", losses.joints},
          {"goal", losses.goal},
          {"doubt", losses.doubt},
          {"critic", losses.critic},
          {"total", losses.total},
          {"gradient", losses.gradient}};
}

void Add(const wandr::TrainingLosses& from, double weight, wandr::TrainingLosses& to) {
  to.translation += weight * from.translation;
  to.orientation += weight * from.orientation;
  to.pose += weight * from.pose;
  to.kl += weight * from.kl;
  to.joints += weight * from.joints;
  to.goal += weight * from.goal;
  to.doubt += weight * from.doubt;
  to.critic += weight * from.critic;
  to.total += weight * from.total;
  to.gradient += weight * from.gradient;
}

// Losses since the last line of their kind.
struct LossSum {
  const char* kind;
  wandr::TrainingLosses total = {};
  int count = 0;

  // Writes their mean as a line, and begins anew.
  void MoveTo(std::vector<json>& lines, long iteration, double seconds) {
    if (count == 0) return;
    wandr::TrainingLosses mean;
    Add(total, 1.0 / count, mean);
    json line = LossesJson(mean);
    line["kind"] = kind;
    line["iteration"] = iteration;
    line["seconds"] = seconds;
    lines.push_back(line);
    total = {};
    count = 0;
  }
};

class WandrTraining {
 public:
  WandrTraining(const TrainWandrCommand& options, const BodyModel& body)
      : options_(options),
        folder_(options.output),
        measures_(MeasureBody(body, Eigen::VectorXd())),
        bones_(wandr::BoneOffsetsOf(measures_.rest_joints).Cast<float>()) {}

  int Run();

 private:
  wandr::TrainingOptions Recipe() const;
  json Evaluate(const wandr::Trainer& trainer) const;
  void Keep(const wandr::Trainer& trainer, const json& validation, const std::string& name) const;
  void WriteLog() const;
  void ReadCorpora();
  /// Of the lines of an earlier run.
  void FindBestBefore();
  void EvaluateAndKeep(const wandr::Trainer& trainer);
  void Train(wandr::Trainer& trainer, const fs::path& checkpoint, Progress& progress);
  void PrintSummary(const wandr::Trainer& trainer) const;

  const TrainWandrCommand& options_;
  fs::path folder_;
  BodyMeasures measures_;
  wandr::BoneOffsets<float> bones_;
  wandr::Corpus corpus_;
  std::optional<wandr::Corpus> held_out_;
  std::vector<json> lines_;
  json best_;  // line of the best evaluation; null before the first
  long best_at_ = 0;
};

wandr::TrainingOptions WandrTraining::Recipe() const {
  wandr::TrainingOptions recipe = options_.paper ? wandr::PaperOptions() : wandr::TrainingOptions();
  recipe.intention.wrist = options_.wrist == "right" ? Side::kRight : Side::kLeft;
  recipe.iterations = options_.iterations;
  recipe.frames_per_iteration = options_.frames;
  recipe.seed = options_.common.seed;
  recipe.threads = NumThreads(options_.common);
  if (!options_.paper) {
    recipe.width = options_.width;
    recipe.blocks = options_.blocks;
    recipe.longest_unroll = options_.unroll;
    recipe.learning_rate = options_.learning_rate;
    recipe.kl_weight = options_.kl;
  }
  recipe.free_from = options_.paper ? 1.0 : options_.free_from;
  recipe.free_share = options_.free_share;
  recipe.anchor = options_.anchor;
  recipe.critic = options_.critic;
  if (!options_.paper) recipe.prior_share = options_.prior;
  recipe.goal_losses.skating = static_cast<float>(options_.skating);
  const auto height = [&](int joint) {
    return static_cast<float>(measures_.rest_joints(1, joint) - measures_.sole_y);
  };
  recipe.standing = {height(7), height(10)};
  return recipe;
}

// The protocol on starts that no table is made of, one sample a goal.
json WandrTraining::Evaluate(const wandr::Trainer& trainer) const {
  const wandr::NetworkWeights weights = trainer.Weights(false);
  const wandr::Network<float> network(weights);
  const wandr::Normaliser<double> norms(weights.statistics);
  const auto starts = wandr::AsFloat(wandr::ComposedStarts(measures_, norms));
  wandr::ReachProtocol protocol = wandr::ReachProtocol::Adaptive();
  protocol.num_samples = 1;
  protocol.seed = 2;
  protocol.intention.wrist = options_.wrist == "right" ? Side::kRight : Side::kLeft;
  const auto outcomes = wandr::RunReachProtocol(network, bones_, starts, protocol,
                                                {.threads = NumThreads(options_.common)});
  const wandr::ReachSummary summary = wandr::Summarise(outcomes);
  json line{{"kind", "reach"},
            {"iteration", trainer.Iteration()},
            {"success", summary.success},
            {"distance_m", summary.distance_mean_m},
            {"distance_median_m", summary.distance_median_m},
            {"skating", summary.skating},
            {"airborne", summary.airborne},
            {"acceleration", summary.acceleration_m_s2}};
  if (held_out_) line["held_out"] = LossesJson(trainer.Validate(*held_out_));
  return line;
}

// <name>.safetensors, and <name>_half.safetensors of half the size, to be shipped.
void WandrTraining::Keep(const wandr::Trainer& trainer, const json& validation,
                         const std::string& name) const {
  wandr::NetworkWeights weights = trainer.Weights(true);
  weights.notes["made_by"] = "holdfast train wandr " HOLDFAST_VERSION;
  weights.notes["iteration"] = std::to_string(trainer.Iteration());
  weights.notes["corpus"] = fmt::format("{:.2f} h captured (mirror images counted), {:.2f} h made",
                                        static_cast<double>(corpus_.captured_frames) / 108000.0,
                                        static_cast<double>(corpus_.made_frames) / 108000.0);
  weights.notes["validation"] = validation.dump();
  wandr::WriteNetwork(weights, folder_ / (name + ".safetensors"));
  wandr::WriteNetwork(weights, folder_ / (name + "_half.safetensors"), true);
}

void WandrTraining::WriteLog() const {
  std::string text;
  for (const json& line : lines_) text += line.dump() + "\n";
  WriteAtomically(folder_ / "training.jsonl", text);
  WriteAtomically(folder_ / "train.html", TrainingPage(lines_, options_.iterations));
}

void WandrTraining::ReadCorpora() {
  Progress progress(options_.common, "reading clips");
  wandr::CorpusOptions what;
  what.made_hours = options_.made_hours;
  what.wrist = options_.wrist == "right" ? Side::kRight : Side::kLeft;
  std::vector<fs::path> folders(options_.corpora.begin(), options_.corpora.end());
  corpus_ = wandr::ReadCorpus(folders, measures_.rest_joints, what,
                              [&](int done, int total) { progress.Update(done, total); });
  if (options_.held_out.empty()) return;
  held_out_.emplace();
  held_out_->clips = wandr::ReadCorpusClips(options_.held_out, what.wrist, nullptr);
  if (held_out_->clips.empty()) {
    throw Error(options_.held_out, "holds no clip to validate with",
                "Leave out --held-out, or keep people away with 'make-reach-data --held-out'");
  }
}

void WandrTraining::FindBestBefore() {
  for (const json& line : lines_) {
    if (line.value("kind", "") != "reach") continue;
    if (best_.is_null() || line["success"] > best_["success"]) {
      best_ = line;
      best_at_ = line["iteration"];
    }
  }
}

void WandrTraining::EvaluateAndKeep(const wandr::Trainer& trainer) {
  const long iteration = trainer.Iteration();
  lines_.push_back(Evaluate(trainer));
  const json& now = lines_.back();
  Note(options_.common,
       fmt::format("iteration {}: {:.1f} % of goals reached, {:.1f} cm, skating {:.0f} %",
                   iteration, 100.0 * now["success"].get<double>(),
                   100.0 * now["distance_m"].get<double>(), 100.0 * now["skating"].get<double>()));
  if (best_.is_null() || now["success"] >= best_["success"]) {
    best_ = now;
    best_at_ = iteration;
    Keep(trainer, best_, "best");
  }
  Keep(trainer, now, "latest");
  WriteLog();
}

void WandrTraining::Train(wandr::Trainer& trainer, const fs::path& checkpoint, Progress& progress) {
  LossSum followed{"train"}, left_free{"free"};
  auto saved = std::chrono::steady_clock::now();
  const auto began = saved;
  const long first = trainer.Iteration();
  while (trainer.Iteration() < options_.iterations && !Interrupted()) {
    const wandr::TrainingLosses losses = trainer.Step();
    LossSum& sum = losses.free ? left_free : followed;
    Add(losses, 1.0, sum.total);
    ++sum.count;
    const long iteration = trainer.Iteration();
    progress.Update(static_cast<int>(iteration - first),
                    static_cast<int>(options_.iterations - first));
    const bool last = iteration == options_.iterations;
    if (iteration % 50 == 0 || last) {
      const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - began;
      followed.MoveTo(lines_, iteration, passed.count());
      left_free.MoveTo(lines_, iteration, passed.count());
    }
    if (iteration % options_.evaluate_every == 0 || last) {
      EvaluateAndKeep(trainer);
      if (options_.patience > 0 && iteration - best_at_ >= options_.patience) break;
    }
    if (std::chrono::steady_clock::now() - saved > std::chrono::minutes(2) || last) {
      trainer.Save(checkpoint);
      saved = std::chrono::steady_clock::now();
    }
  }
  trainer.Save(checkpoint);
  WriteLog();
}

void WandrTraining::PrintSummary(const wandr::Trainer& trainer) const {
  json summary = JsonHead("holdfast/train-wandr/1", options_.common);
  summary["iterations"] = trainer.Iteration();
  summary["best"] = best_;
  const std::string reached =
      best_.is_null() ? "not evaluated yet"
                      : fmt::format("{:.1f} % of goals reached, {:.1f} cm (iteration {})",
                                    100.0 * best_["success"].get<double>(),
                                    100.0 * best_["distance_m"].get<double>(), best_at_);
  PrintResult(options_.common, summary,
              fmt::format("{}: {} iterations\n  best    {}\n  curves  {}\n",
                          (folder_ / "best.safetensors").string(), trainer.Iteration(), reached,
                          (folder_ / "train.html").string()));
}

int WandrTraining::Run() {
  const fs::path checkpoint = folder_ / "checkpoint.safetensors";
  const bool goes_on = fs::exists(checkpoint) && !options_.common.force;
  fs::create_directories(folder_);
  ReadCorpora();
  std::optional<wandr::NetworkWeights> from;
  if (!options_.from.empty()) from = wandr::ReadNetwork(options_.from);
  wandr::Trainer trainer(corpus_, bones_, Recipe(), from ? &*from : nullptr);
  if (goes_on) {
    trainer.Load(checkpoint);
    lines_ = LinesBefore(folder_ / "training.jsonl", trainer.Iteration());
    Note(options_.common, fmt::format("going on after iteration {}", trainer.Iteration()));
  }
  Note(options_.common,
       fmt::format("{} clips, {:.2f} h captured (with mirror images), {:.2f} h made; {:.2f} M "
                   "parameters",
                   corpus_.clips.size(), static_cast<double>(corpus_.captured_frames) / 108000.0,
                   static_cast<double>(corpus_.made_frames) / 108000.0,
                   static_cast<double>(trainer.NumParameters()) / 1e6));
  FindBestBefore();
  Progress progress(options_.common, "iterations");
  Train(trainer, checkpoint, progress);
  PrintSummary(trainer);
  if (Interrupted()) {
    Note(options_.common, "interrupted: the same command goes on from here");
    return kInterrupted;
  }
  return kDone;
}

}  // namespace

void AddTrainWandrCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<TrainWandrCommand>();
  CLI::App* command = app.add_subcommand(
      "wandr", "Trains WANDR's c-VAE: motion that walks to goals and reaches for them");
  command->add_option("corpus", options->corpora, "Folders of clips, as of 'make-reach-data'")
      ->required();
  command
      ->add_option(
          "-o,--output", options->output,
          "Folder: best.safetensors, checkpoint, curves (train.html); resumed if it exists")
      ->required();
  command->add_option("--held-out", options->held_out,
                      "Folder of clips not trained on, for the curves");
  command->add_option("--from", options->from, "Weights to begin with, with their statistics");
  command->add_flag("--paper", options->paper, "The published network, features and losses");
  command->add_option("--width", options->width, "Width of the residual network")
      ->capture_default_str()
      ->check(CLI::Range(16, 4096));
  command
      ->add_option("--blocks", options->blocks,
                   "Blocks of the decoder; the encoder has half as many")
      ->capture_default_str()
      ->check(CLI::Range(1, 64));
  command->add_option("--iterations", options->iterations, "Optimizer steps")
      ->capture_default_str()
      ->check(CLI::Range(1l, 100'000'000l));
  command->add_option("--frames", options->frames, "Frames per iteration, unrolled ones counted")
      ->capture_default_str()
      ->check(CLI::Range(64, 1 << 20));
  command->add_option("--unroll", options->unroll, "Longest rollout in training, frames")
      ->capture_default_str()
      ->check(CLI::IsMember({1, 2, 4, 8, 16, 32, 64}));
  command->add_option("--learning-rate", options->learning_rate, "AdamW learning rate")
      ->capture_default_str()
      ->check(CLI::Range(1e-7, 1.0));
  command
      ->add_option("--kl", options->kl, "Weight of the KL divergence of the latents from N(0, 1)")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 100.0));
  command
      ->add_option("--free-from", options->free_from,
                   "Share of the iterations after which full rollouts to goals are trained too")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1.0));
  command
      ->add_option("--free-share", options->free_share,
                   "Share of full rollouts in the iterations after that")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1.0));
  command
      ->add_option("--anchor", options->anchor,
                   "Weight of staying near the earlier network in full rollouts")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1e6));
  command->add_option("--critic", options->critic, "Weight of the adversarial loss")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1e3));
  command
      ->add_option("--prior-share", options->prior,
                   "Share of followed windows driven by latents of N(0, 1), not the encoder's")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1.0));
  command->add_option("--skating", options->skating, "Weight of sliding feet in full rollouts")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1e3));
  command
      ->add_option("--made-hours", options->made_hours,
                   "At most this many hours of generated motion")
      ->check(CLI::Range(0.0, 1e6));
  command->add_option("--wrist", options->wrist, "Wrist used for reaching")
      ->capture_default_str()
      ->check(CLI::IsMember({"right", "left"}));
  command->add_option("--evaluate-every", options->evaluate_every, "Iterations between evaluations")
      ->capture_default_str()
      ->check(CLI::Range(1, 1'000'000));
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
      "  holdfast reach --goal 1.5,1.0,1.1 --weights out/wandr/best.safetensors\n");
  command->callback([options, &exit_code] {
    exit_code = WandrTraining(*options, *LoadBody(options->body)).Run();
  });
}

}  // namespace holdfast::apps
