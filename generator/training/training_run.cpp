// SPDX-License-Identifier: MIT
#include "generator/training/training_run.h"

#include <chrono>
#include "geometry/io/container/json_file.h"

namespace holdfast {
namespace {

using nlohmann::json;

// Losses since the last line of their kind.
struct LossSum {
  json line;
  std::map<std::string, double> total;
  int count = 0;
};

}  // namespace

json RunTraining(const Training& training, const RunOptions& options, const RunWatch& watch) {
  using Clock = std::chrono::steady_clock;
  IterativeTrainer& trainer = training.trainer;
  const std::filesystem::path checkpoint = options.folder / "checkpoint.safetensors";
  std::vector<json> lines = options.lines;
  json best;
  for (const json& line : lines) {
    if (line.value("kind", "") != training.evaluation) continue;
    if (best.is_null() || training.is_better(line, best)) best = line;
  }
  std::map<std::string, LossSum, std::greater<>> sums;  // "train" before "free"
  const auto keep = [&](const json& line, const char* name) {
    TrainingNotes notes = options.notes;
    notes["iteration"] = std::to_string(trainer.Iteration());
    notes["validation"] = JsonText(line);
    training.write(notes, (options.folder / name).string());
  };
  const auto began = Clock::now();
  auto saved = began;
  const long first = trainer.Iteration(), end = training.iterations;
  while (trainer.Iteration() < end && !(watch.stop && watch.stop())) {
    json losses, line;
    training.step(losses, line);
    LossSum& sum = sums[line["kind"].get<std::string>()];
    for (const auto& [name, value] : losses.items()) sum.total[name] += value.get<double>();
    sum.line = line;
    ++sum.count;
    const long iteration = trainer.Iteration();
    if (watch.progress) {
      watch.progress(static_cast<int>(iteration - first), static_cast<int>(end - first));
    }
    const bool last = iteration == end;
    if (iteration % 50 == 0 || last) {
      for (auto& [kind, mean] : sums) {
        for (const auto& [name, total] : mean.total) mean.line[name] = 1.0 / mean.count * total;
        mean.line["iteration"] = iteration;
        mean.line["seconds"] = std::chrono::duration<double>(Clock::now() - began).count();
        lines.push_back(mean.line);
      }
      sums.clear();
    }
    if (iteration % options.evaluate_every == 0 || last) {
      json now = training.evaluate();
      now["kind"] = training.evaluation;
      now["iteration"] = iteration;
      lines.push_back(now);
      if (watch.evaluated) watch.evaluated(now);
      if (best.is_null() || training.is_better(now, best)) keep(best = now, "best");
      keep(now, "latest");
      if (watch.log) watch.log(lines);
      if (options.patience > 0 && iteration - best["iteration"].get<long>() >= options.patience) {
        break;
      }
    }
    if (Clock::now() - saved > std::chrono::minutes(2) || last) {
      trainer.Save(checkpoint);
      saved = Clock::now();
    }
  }
  trainer.Save(checkpoint);
  if (watch.log) watch.log(lines);
  return best;
}

}  // namespace holdfast
