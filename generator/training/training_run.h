// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace holdfast {

/// What is trained iteration by iteration, and can go on where it was.
class IterativeTrainer {
 public:
  virtual ~IterativeTrainer() = default;
  virtual long Iteration() const = 0;
  virtual long NumParameters() const = 0;
  /// Everything needed to go on exactly: weights, statistics, moments, schedule. Atomic.
  virtual void Save(const std::filesystem::path& path) const = 0;
  /// Throws Error when the file is none of Save's, or of other options.
  virtual void Load(const std::filesystem::path& path) = 0;
};

/// The numbers that T::kParts names, by name.
template <typename T>
nlohmann::json JsonOf(const T& numbers) {
  nlohmann::json json;
  for (const auto& [name, part] : T::kParts) json[name] = numbers.*part;
  return json;
}

using TrainingNotes = std::map<std::string, std::string>;

/// A network in training, as RunTraining sees it; ActionTraining and ReachTraining make one. Lines
/// are JSON objects with `kind` and `iteration`.
struct Training {
  IterativeTrainer& trainer;
  long iterations;         ///< in all
  const char* evaluation;  ///< kind of the lines of evaluations
  /// One more iteration: adds its losses' names and values to the first, and fills the second with
  /// the rest of their line, `kind` at least.
  std::function<void(nlohmann::json& losses, nlohmann::json& line)> step;
  std::function<nlohmann::json()> evaluate;
  /// Whether an evaluation is to be kept in place of the best so far.
  std::function<bool(const nlohmann::json& now, const nlohmann::json& best)> is_better;
  /// Writes <stem>.safetensors with all that training needs and <stem>_half.safetensors.
  std::function<void(const TrainingNotes&, const std::string& stem)> write;
};

struct RunOptions {
  std::filesystem::path folder;       ///< for what is kept; exists
  int evaluate_every = 200;           ///< iterations
  int patience = 0;                   ///< ends after so many without improvement; 0: does not
  TrainingNotes notes;                ///< that the weights carry too
  std::vector<nlohmann::json> lines;  ///< of the time before the checkpoint that was loaded
};

/// What sees a run; each may be empty.
struct RunWatch {
  std::function<void(int done, int total)> progress;            ///< iterations of this run
  std::function<bool()> stop;                                   ///< true: no further iteration
  std::function<void(const nlohmann::json& line)> evaluated;    ///< the line of an evaluation
  std::function<void(const std::vector<nlohmann::json>&)> log;  ///< all lines, now and then
};

/// Trains to the end, with lines of mean losses every 50 iterations; keeps checkpoint.safetensors
/// (every two minutes) and the weights best and latest. Returns the line of the best evaluation,
/// null before the first. Throws Error when losses are no longer finite or a file cannot be
/// written.
nlohmann::json RunTraining(const Training& training, const RunOptions& options,
                           const RunWatch& watch = {});

}  // namespace holdfast
