// SPDX-License-Identifier: MIT
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/train/train_command.h"
#include "generator/body/rest_pelvis_note.h"
#include "generator/imos/synthesis_metrics.h"
#include "generator/imos/vocabulary.h"
#include "generator/training/imos/recognizer.h"
#include "geometry/error.h"

namespace holdfast::apps {
namespace {

using nlohmann::json;

struct TrainRecognizerCommand {
  CommonOptions common;
  ActionClips clips;
  std::string output;
  bool paper = false;
  Recipe<imos::RecognizerOptions> recipe;
};

// With `mirrored` the other hand does the same.
imos::LabeledMotions MotionsOf(const std::vector<imos::ActionSequence>& sequences,
                               bool mirrored = false) {
  imos::LabeledMotions set;
  for (const imos::ActionSequence& sequence : sequences) {
    set.motions.push_back(sequence.joints);
    set.labels.push_back(sequence.action);
    if (!mirrored) continue;
    set.motions.push_back(imos::Mirrored(sequence).joints);
    set.labels.push_back(sequence.action);
  }
  return set;
}

// Accuracy on a set, in all and by action; what was taken for what.
json AccuracyJson(const imos::Recognizer& recognizer, const imos::LabeledMotions& set,
                  int threads) {
  const imos::Recognition seen = recognizer.Recognize(set.motions, threads);
  std::map<int, std::pair<int, int>> by_action;  // right, all
  json mistaken = json::object();
  for (std::size_t n = 0; n < set.labels.size(); ++n) {
    auto& [right, all] = by_action[set.labels[n]];
    right += seen.labels[n] == set.labels[n];
    ++all;
    if (seen.labels[n] == set.labels[n]) continue;
    json& count = mistaken[fmt::format("{} for {}", imos::Actions()[set.labels[n]].label,
                                       imos::Actions()[seen.labels[n]].label)];
    count = count.is_null() ? 1 : count.get<int>() + 1;
  }
  json result = {{"sequences", set.labels.size()},
                 {"accuracy", imos::RecognitionAccuracy(seen.labels, set.labels)},
                 {"mistaken", mistaken}};
  for (const auto& [action, counts] : by_action) {
    result["by_action"][std::string(imos::Actions()[action].label)] = {
        {"sequences", counts.second},
        {"accuracy", static_cast<double>(counts.first) / counts.second}};
  }
  return result;
}

std::string Line(const char* what, const json& accuracy) {
  std::string text =
      fmt::format("  {:<12}{:5.1f} % of {} sequences", what,
                  100.0 * accuracy["accuracy"].get<double>(), accuracy["sequences"].get<int>());
  std::vector<std::string> mistakes;
  for (const auto& [which, count] : accuracy["mistaken"].items()) {
    mistakes.push_back(fmt::format("{} ({})", which, count.get<int>()));
  }
  if (!mistakes.empty()) text += fmt::format("; mistaken: {}", fmt::join(mistakes, ", "));
  return text + "\n";
}

int TrainRecognizer(const TrainRecognizerCommand& options) {
  const CommonOptions& common = options.common;
  RequireNew(options.output, common);
  const imos::ActionSet set = options.clips.Read(common);
  for (const std::string& note : set.notes) Note(common, note);
  if (set.train.empty()) {
    throw Error(fmt::format("{}", fmt::join(options.clips.folders, ", ")),
                fmt::format("every clip is of a subject held out ({}) or for validation ({})",
                            fmt::join(options.clips.held_out, ","),
                            fmt::join(options.clips.validation, ",")),
                "Give other --held-out or --validation, or more subjects");
  }
  const imos::LabeledMotions training = MotionsOf(set.train, !options.paper);
  const imos::LabeledMotions validation = MotionsOf(set.validation);
  const imos::LabeledMotions held_out = MotionsOf(set.test);

  imos::RecognizerOptions recipe =
      options.paper ? options.recipe.Over(imos::PaperRecognizerOptions()) : options.recipe.given;
  recipe.seed = common.seed;
  imos::TrainedRecognizer trained = [&] {
    Progress progress(common, "epochs");
    return imos::TrainRecognizer(training, validation, recipe,
                                 [&](const imos::RecognizerEpoch& now) {
                                   progress.Update(now.epoch, recipe.epochs);
                                   return !Interrupted();
                                 });
  }();
  if (Interrupted()) return kInterrupted;  // a quarter-trained judge is worse than none

  const imos::Recognizer recognizer(trained.weights);
  json summary = JsonHead("holdfast/train-recognizer/1", common);
  summary["epochs"] = trained.epochs.size();
  summary["kept_epoch"] = trained.best.epoch;
  summary["training_loss"] = trained.best.training_loss;
  std::string text = fmt::format("{}: epoch {} of {}\n", options.output, trained.best.epoch,
                                 trained.epochs.size());
  const int threads = NumThreads(common);
  for (const auto& [name, motions] :
       {std::pair{"training", &training}, {"validation", &validation}, {"held out", &held_out}}) {
    if (motions->motions.empty()) continue;
    summary[name] = AccuracyJson(recognizer, *motions, threads);
    text += Line(name, summary[name]);
    trained.weights.notes[fmt::format("accuracy, {}", name)] =
        fmt::format("{:.4f} of {}", summary[name]["accuracy"].get<double>(),
                    summary[name]["sequences"].get<int>());
  }
  trained.weights.notes["made_by"] = "holdfast train recognizer " HOLDFAST_VERSION;
  NoteRestPelvis(trained.weights.notes);
  trained.weights.notes["key_frames"] = options.clips.key_frames;
  trained.weights.notes["seed"] = std::to_string(common.seed);
  trained.weights.notes["epochs"] = std::to_string(trained.best.epoch);
  trained.weights.notes["held_out"] = fmt::format("{}", fmt::join(options.clips.held_out, ","));
  imos::WriteRecognizer(trained.weights, options.output);
  PrintResult(common, summary, text);
  return kDone;
}

}  // namespace

void AddTrainRecognizerCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<TrainRecognizerCommand>();
  Recipe<imos::RecognizerOptions>& recipe = options->recipe;
  using Training = imos::RecognizerOptions;
  ActionClips& clips = options->clips;
  CLI::App* command =
      app.add_subcommand("recognizer", "Trains the action classifier of 'evaluate synthesis'");
  command->add_option("folders", clips.folders, "Folders of action clips, as of 'make-actions'")
      ->required();
  command->add_option("-o,--output", options->output, "File to write (.safetensors)")->required();
  AddList(*command, "--held-out", clips.held_out,
          "Subjects that are not trained on: those that will be evaluated");
  AddList(*command, "--validation", clips.validation,
          "Subjects for early stopping; not trained on");
  command->add_option("--without", clips.without, "Actions to leave out (as published: lift)")
      ->delimiter(',');
  AddOption(*command, "--key-frames", clips.key_frames,
            "15 spread over the clip (whole), or over the contact as published (paper)",
            CLI::IsMember({"whole", "paper"}));
  command->add_flag("--paper", options->paper,
                    "As published, where no option says otherwise: 500 epochs, batches of one, "
                    "rate 5e-4, no noise, no early stop");
  recipe.AddNumber(*command, "--epochs", &Training::epochs, 1, 1'000'000, "At most");
  recipe.AddNumber(*command, "--batch", &Training::batch, 1, 100'000, "Sequences per step");
  recipe.AddNumber(*command, "--learning-rate", &Training::learning_rate, 1e-9, 1.0,
                   "Adam learning rate");
  recipe.AddNumber(*command, "--jitter", &Training::jitter_m, 0.0, 1.0,
                   "Standard deviation of noise on every coordinate, meters");
  recipe.AddNumber(*command, "--patience", &Training::patience, 0, 1'000'000,
                   "Stop after that many epochs without improvement on validation; 0: never");
  command->add_option("--body", clips.body, "SMPL-X .npz [the embedded body]");
  AddCommonOptions(
      *command, options->common, true,
      "  holdfast train recognizer actions -o recognizer.safetensors --held-out s9,s10\n"
      "  holdfast train recognizer grab_clips --without lift --key-frames paper --paper -o "
      "paper.safetensors\n");
  command->callback([options, &exit_code] { exit_code = TrainRecognizer(*options); });
}

}  // namespace holdfast::apps
