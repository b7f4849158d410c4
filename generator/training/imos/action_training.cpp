// SPDX-License-Identifier: MIT
#include "generator/training/imos/action_training.h"

#include <algorithm>

#include <fmt/format.h>

#include "generator/imos/vocabulary.h"
#include "geometry/io/container/json_file.h"

namespace holdfast::imos {
namespace {

using nlohmann::json;

// What those who run the network must know of what it was trained on: {"drink": 0.21, ...} seconds
// per key frame, and {"drink": {"mug": 12, ...}, ...} sequences.
TrainingNotes DataNotes(const ActionSet& set) {
  std::map<std::string, double> seconds;
  std::map<std::string, int> counts;
  std::map<std::string, std::map<std::string, int>> seen;
  bool mirrored = false;
  for (const ActionSequence& sequence : set.train) {
    mirrored = mirrored || sequence.mirrored;
    if (sequence.mirrored) continue;
    const std::string action(Actions()[sequence.action].label);
    seconds[action] += sequence.seconds_per_key_frame;
    ++counts[action];
    ++seen[action][std::string(Objects()[sequence.object])];
  }
  for (auto& [action, sum] : seconds) sum /= counts[action];
  return {{"seconds_per_key_frame", JsonText(json(seconds))},
          {"seen", JsonText(json(seen))},
          {"data", fmt::format("{} sequences{}, {} to validate, {} held out", set.train.size(),
                               mirrored ? " (mirror images counted)" : "", set.validation.size(),
                               set.test.size())}};
}

}  // namespace

const json& ErrorsOf(const json& line) {
  return line.contains("validation") ? line["validation"] : line["train"];
}

Training ActionTraining(Trainer& trainer, const ActionSet& set) {
  Training training{trainer, trainer.Options().iterations, "rollout", {}, {}, {}, {}};
  training.step = [&](json& losses, json& line) {
    line["kind"] = "train";
    line["learning_rate"] = trainer.LearningRate();
    losses = JsonOf(trainer.Step());
  };
  std::vector<ActionSequence> some;  // to compare with those that are not trained on
  const std::size_t step = std::max<std::size_t>(1, set.train.size() / 100);
  for (std::size_t k = 0; k < set.train.size(); k += step) some.push_back(set.train[k]);
  training.evaluate = [&, some = std::move(some)] {
    json line;
    line["train"] = JsonOf(trainer.Evaluate(some));
    if (!set.validation.empty()) line["validation"] = JsonOf(trainer.Evaluate(set.validation));
    return line;
  };
  training.is_better = [&](const json& now, const json& best) {
    return trainer.Options().critic > 0.0 ||
           ErrorsOf(now)["mpjpe_m"].get<double>() <= ErrorsOf(best)["mpjpe_m"].get<double>();
  };
  training.write = [&](const TrainingNotes& notes, const std::string& stem) {
    NetworkWeights weights = trainer.Weights(true);
    weights.notes = DataNotes(set);
    weights.notes.insert(notes.begin(), notes.end());
    WriteNetwork(weights, stem + ".safetensors");
    WriteNetwork(WithoutTraining(std::move(weights)), stem + "_half.safetensors", true);
  };
  return training;
}

}  // namespace holdfast::imos
