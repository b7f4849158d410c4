// SPDX-License-Identifier: MIT
#include "apps/train/train_command.h"

#include <fmt/format.h>

#include "apps/train/training_curves.h"
#include "generator/body/rest_pelvis_note.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/json_file.h"

namespace holdfast::apps {

using nlohmann::json;

imos::ActionSet ActionClips::Read(const CommonOptions& common) const {
  imos::ActionSetOptions what;
  what.sequences.rule =
      key_frames == "paper" ? imos::KeyFrameRule::kPaper : imos::KeyFrameRule::kWhole;
  what.split = {validation, held_out};
  what.without = without;
  what.threads = NumThreads(common);
  const std::shared_ptr<const BodyModel> model = LoadBody(body);
  Progress progress(common, "reading clips");
  return imos::ReadActionSet({folders.begin(), folders.end()}, model, what,
                             [&](int done, int total) { progress.Update(done, total); });
}

void LongTraining::AddOutput(CLI::App& command) {
  command
      .add_option("-o,--output", output,
                  "Folder: best.safetensors, checkpoint, curves (train.html); resumed if it exists")
      ->required();
}

int Train(const Training& training, const LongTraining& options, const TrainingTexts& texts) {
  const CommonOptions& common = options.common;
  IterativeTrainer& trainer = training.trainer;
  RunOptions run{options.output, options.evaluate_every, options.patience, texts.kept, {}};
  const std::filesystem::path checkpoint = run.folder / "checkpoint.safetensors";
  if (!common.force && std::filesystem::exists(checkpoint)) {
    trainer.Load(checkpoint);
    run.lines = LinesBefore(run.folder / "training.jsonl", trainer.Iteration());
    Note(common, fmt::format("resuming after iteration {}", trainer.Iteration()));
  }
  run.notes["made_by"] = fmt::format("holdfast train {} " HOLDFAST_VERSION, texts.network);
  NoteRestPelvis(run.notes);
  std::filesystem::create_directories(run.folder);
  for (const std::string& note : texts.notes) Note(common, note);
  RunWatch watch;
  std::optional<Progress> progress(std::in_place, common, "iterations");
  watch.progress = [&](int done, int total) { progress->Update(done, total); };
  watch.stop = Interrupted;
  watch.evaluated = [&](const json& line) {
    Note(common,
         fmt::format("iteration {}: {}", line["iteration"].get<long>(), texts.evaluation(line)));
  };
  watch.log = [&](const std::vector<json>& lines) {
    std::string text;
    for (const json& line : lines) text += JsonText(line) + "\n";
    WriteAtomically(run.folder / "training.jsonl", text);
    WriteAtomically(run.folder / "train.html", texts.page(lines, training.iterations));
  };
  const json best = RunTraining(training, run, watch);
  progress.reset();

  json summary = JsonHead(fmt::format("holdfast/train-{}/1", texts.network), common);
  summary.update(texts.summary);
  summary["iterations"] = trainer.Iteration();
  summary["best"] = best;
  const std::string reached = best.is_null() ? "not evaluated yet"
                                             : fmt::format("{} (iteration {})", texts.best(best),
                                                           best["iteration"].get<long>());
  PrintResult(common, summary,
              fmt::format("{}: {} iterations\n  best    {}\n  curves  {}\n",
                          (run.folder / "best.safetensors").string(), trainer.Iteration(), reached,
                          (run.folder / "train.html").string()));
  if (!Interrupted()) return kDone;
  Note(common, "interrupted: the same command resumes from here");
  return kInterrupted;
}

}  // namespace holdfast::apps
