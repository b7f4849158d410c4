// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <type_traits>
#include <vector>

#include "apps/common.h"
#include "generator/imos/action_set.h"
#include "generator/training/training_run.h"

namespace holdfast::apps {

void AddTrainImosCommand(CLI::App& app, int& exit_code);
void AddTrainRecognizerCommand(CLI::App& app, int& exit_code);
void AddTrainWandrCommand(CLI::App& app, int& exit_code);

/// An option of a number from `least` to `most`, its default shown.
template <typename T>
CLI::Option* AddNumber(CLI::App& command, const char* name, T& value, std::type_identity_t<T> least,
                       std::type_identity_t<T> most, const char* help) {
  return command.add_option(name, value, help)
      ->capture_default_str()
      ->check(CLI::Range(least, most));
}

/// What is trained with: the defaults, or with --paper a published recipe, and over it what was
/// given on the command line.
template <typename Options>
class Recipe {
 public:
  Options given;  ///< what the options of the command are read into

  /// An option of a number that a published recipe also has.
  template <typename T>
  CLI::Option* AddNumber(CLI::App& command, const char* name, T Options::*part,
                         std::type_identity_t<T> least, std::type_identity_t<T> most,
                         const char* help) {
    return Keep(apps::AddNumber(command, name, given.*part, least, most, help), part);
  }
  /// The same of an option of another kind.
  template <typename T>
  CLI::Option* Keep(CLI::Option* option, T Options::*part) {
    keep_.push_back([=](const Options& from, Options& to) {
      if (option->count() > 0) to.*part = from.*part;
    });
    return option;
  }
  Options Over(Options published) const {
    for (const auto& keep : keep_) keep(given, published);
    return published;
  }

 private:
  std::vector<std::function<void(const Options&, Options&)>> keep_;
};

/// A list whose items stand between commas, its default shown.
inline CLI::Option* AddList(CLI::App& command, const char* name, std::vector<std::string>& values,
                            const char* help) {
  return command.add_option(name, values, help)->delimiter(',')->capture_default_str();
}

/// Sequences of action clips to train on, as options name them.
struct ActionClips {
  std::vector<std::string> folders, validation{"s1"}, held_out{"s10"}, without;
  std::string body, key_frames = "whole";

  /// Shows progress. Throws Error as imos::ReadActionSet does.
  imos::ActionSet Read(const CommonOptions& common) const;
};

/// Options of a training that may be interrupted and go on.
struct LongTraining {
  CommonOptions common;
  std::string output, from;
  bool paper = false;
  int evaluate_every = 200, patience = 0;

  void AddOutput(CLI::App& command);
};

/// What a training says of itself.
struct TrainingTexts {
  const char* network;                                ///< as `holdfast train` knows it
  TrainingNotes kept;                                 ///< notes that the weights carry, too
  std::vector<std::string> notes;                     ///< before it begins
  nlohmann::json summary = nlohmann::json::object();  ///< what is its own
  std::function<std::string(const nlohmann::json&)> evaluation, best;  ///< of a line, in short
  std::string (*page)(const std::vector<nlohmann::json>& lines, long iterations);
};

/// Goes on where a checkpoint is, trains, keeps training.jsonl and train.html, and prints the
/// summary. Returns the exit code.
int Train(const Training& training, const LongTraining& options, const TrainingTexts& texts);

/// Pages of curves, complete in themselves, of the lines of training.jsonl: errors of free rollouts
/// on subjects not trained on, or goals reached, distance left and skating; and the losses.
std::string ImosTrainingPage(const std::vector<nlohmann::json>& lines, long iterations);
std::string WandrTrainingPage(const std::vector<nlohmann::json>& lines, long iterations);

}  // namespace holdfast::apps
