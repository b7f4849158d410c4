// SPDX-License-Identifier: MIT
#include "apps/evaluate/evaluate_fit.h"

#include <algorithm>
#include <map>
#include <optional>
#include <vector>

#include <fmt/format.h>

#include "apps/batch.h"
#include "apps/clip_input.h"
#include "apps/fit_job.h"
#include "geometry/conventions/series.h"
#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/json_file.h"
#include "solver/evaluation/handover_study.h"
#include "solver/score/metric_values.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRecipes[] = {"paper", "imos-code", "holdfast"};

// A row of the table: one number of a recipe over all its clips.
struct FitRow {
  const char* key;  // of MetricValues
  const char* label;
  const char* unit;
  double factor;
  int digits;
  enum class Of { kMean, kWorst } of;
  const char* wanted;
};
constexpr FitRow kRows[] = {
    {"deep_penetration_frames_ratio", "frames with penetration deeper than 2 mm, both ways", "%",
     100.0, 2, FitRow::Of::kMean, "under 2 %"},
    {"intersection_volume_cm3", "intersection volume, mean", "cm3", 1.0, 3, FitRow::Of::kMean,
     "under 0.3 cm3"},
    {"contact_frames_ratio", "frames in contact", "%", 100.0, 1, FitRow::Of::kMean,
     "at least 98 %"},
    {"contact_drift_max_mm", "contact drift, mean of each clip's largest", "mm", 1.0, 2,
     FitRow::Of::kMean, ""},
    {"contact_drift_max_mm", "contact drift, worst clip", "mm", 1.0, 2, FitRow::Of::kWorst,
     "within 2 mm"},
    {"jitter_acceleration_ratio", "object's acceleration over the hand's, mean", "", 1.0, 3,
     FitRow::Of::kMean, "at most 1.1"},
    {"jitter_acceleration_ratio", "object's acceleration over the hand's, worst clip", "", 1.0, 3,
     FitRow::Of::kWorst, ""},
    {"object_in_body_frames_ratio", "frames with the object deeper than 2 mm in the own body", "%",
     100.0, 2, FitRow::Of::kMean, "under 1 %"},
    {"object_in_body_max_mm", "object in the own body, worst clip", "mm", 1.0, 1,
     FitRow::Of::kWorst, ""},
    {"self_penetration_frames_ratio",
     "frames with hand or forearm deeper than 2 mm in the own body", "%", 100.0, 2,
     FitRow::Of::kMean, "under 1 %"},
    {"self_penetration_max_mm", "hand or forearm in the own body, worst clip", "mm", 1.0, 1,
     FitRow::Of::kWorst, ""},
};

struct Study {
  std::vector<std::string> names;
  std::vector<MetricValues> values;
  std::vector<double> solve_ms;
  std::vector<std::string> faults;
};

// The job as this recipe does it. All start from the grasp that the paper's made.
FitCommand ForRecipe(const FitCommand& job, const std::string& recipe, const fs::path& folder) {
  FitCommand made = job;
  CarryOptions& carry = made.job.carry;
  carry.recipe = recipe == "paper"       ? FitRecipe::kPaper
                 : recipe == "imos-code" ? FitRecipe::kImosCode
                                         : FitRecipe::kHoldfast;
  made.write_report = false;
  made.output = (folder / recipe / job.output).string();
  if (carry.hands == CarryHands::kAuto) carry.hands = CarryHands::kRight;
  if (recipe != "paper") {
    made.job.clip = (folder / "paper" / job.output / "clip.npz").string();
    made.job.start = 0;
    made.job.end = -1;
  }
  return made;
}

std::optional<double> Value(const Study& study, const FitRow& row) {
  double sum = 0.0;
  std::optional<double> worst;
  int count = 0;
  for (const MetricValues& clip : study.values) {
    const auto found = clip.find(row.key);
    if (found == clip.end() || !found->second) continue;
    sum += *found->second;
    worst = std::max(worst.value_or(*found->second), *found->second);
    ++count;
  }
  if (count == 0) return std::nullopt;
  return row.factor * (row.of == FitRow::Of::kMean ? sum / count : *worst);
}

std::string Table(const std::map<std::string, Study>& studies, const HandoverStudy& handovers) {
  std::string text =
      "| | paper's terms | authors' code | Holdfast | target |\n|---|---|---|---|---|\n";
  for (const FitRow& row : kRows) {
    text += fmt::format("| {} |", row.label);
    for (const char* recipe : kRecipes) {
      const std::optional<double> value = Value(studies.at(recipe), row);
      const std::string unit = row.unit[0] == '\0' ? "" : fmt::format(" {}", row.unit);
      text += value ? fmt::format(" {:.{}f}{} |", *value, row.digits, unit) : " - |";
    }
    text += fmt::format(" {} |\n", row.wanted);
  }
  text += fmt::format(
      "| hand-overs found within 2 frames, object's trajectory with noise | - | - | {} of {} | 38 "
      "of "
      "40 |\n| hand-overs found within 2 frames, from the body alone | - | - | {} of {} | |\n",
      handovers.found_with_object, handovers.clips.size(), handovers.found_without_object,
      handovers.clips.size());
  return text;
}

std::string TimesText(const std::map<std::string, Study>& studies) {
  std::string text = "solve, ms per frame (median of clips):";
  for (const char* recipe : kRecipes) {
    text += fmt::format(" {} {:.2f}", recipe, Median(studies.at(recipe).solve_ms));
  }
  return text + "\n";
}

// Fits a clip unless its result is there, scores it, and adds it to the study; `values` is its
// score. False when interrupted.
bool FitAndScore(const FitCommand& job, const std::string& name, const ScoreOptions& score_options,
                 const CommonOptions& common, FitLibrary& library, Study& study,
                 nlohmann::json& values) {
  const fs::path metrics_path = fs::path(job.output) / "metrics.json";
  if (!fs::exists(metrics_path)) {
    RunFitCommand(job, common, library);
    if (Interrupted()) return false;
  }
  const ClipInput input = LoadClipInput(job.output, {}, common);
  const ClipScore score =
      ScoreClip(input, nullptr, score_options, [](auto...) { return !Interrupted(); });
  if (Interrupted()) return false;
  study.names.push_back(name);
  study.values.push_back(ClipValues(score, score_options));
  const fs::path times_path = fs::path(job.output) / "timing.json";
  if (const nlohmann::json times = ReadJson(times_path); times.is_object()) {
    study.solve_ms.push_back(
        UseJson(times_path, [&] { return times.at("summary").value("solve_ms_median", 0.0); }));
  }
  for (const auto& [key, value] : study.values.back()) {
    values[key] = value ? nlohmann::json(*value) : nlohmann::json(nullptr);
  }
  return true;
}

// All jobs by all recipes, and each clip's scores; nothing when interrupted. A fault of one fit is
// recorded, and the others go on.
std::optional<nlohmann::json> FitByAllRecipes(const std::vector<FitCommand>& jobs,
                                              const fs::path& folder, const CommonOptions& common,
                                              Progress& progress,
                                              std::map<std::string, Study>& studies) {
  ScoreOptions score_options;
  score_options.hand_object.contact.threads = NumThreads(common);
  FitLibrary library;
  CommonOptions inner = common;
  inner.quiet = true;
  inner.force = true;
  const int total = static_cast<int>(jobs.size() * std::size(kRecipes));
  int done = 0;
  nlohmann::json clips = nlohmann::json::array();
  for (const FitCommand& job : jobs) {
    nlohmann::json entry = {
        {"name", job.output}, {"clip", job.job.clip}, {"object", job.job.object}};
    for (const char* recipe : kRecipes) {
      Study& study = studies[recipe];
      const FitCommand made = ForRecipe(job, recipe, folder);
      try {
        nlohmann::json values;
        if (!FitAndScore(made, job.output, score_options, inner, library, study, values)) {
          return std::nullopt;
        }
        entry[recipe] = values;
      } catch (const std::exception& error) {
        study.faults.push_back(fmt::format("{}: {}", job.output, error.what()));
        entry[recipe] = {{"fault", error.what()}};
        Note(common, study.faults.back());
      }
      progress.Update(++done, total);
    }
    clips.push_back(std::move(entry));
  }
  return std::optional<nlohmann::json>(std::in_place, std::move(clips));
}

nlohmann::json FitEvaluationJson(const std::map<std::string, Study>& studies, nlohmann::json clips,
                                 const HandoverStudy& handovers, const CommonOptions& common) {
  nlohmann::json evaluation = JsonHead("holdfast/evaluate-fit/1", common);
  evaluation["clips"] = std::move(clips);
  for (const char* recipe : kRecipes) {
    const Study& study = studies.at(recipe);
    for (const FitRow& row : kRows) {
      const std::optional<double> value = Value(study, row);
      const std::string key =
          std::string(row.key) + (row.of == FitRow::Of::kMean ? "_mean" : "_worst");
      evaluation["summary"][recipe][key] = value ? nlohmann::json(*value / row.factor) : nullptr;
    }
    evaluation["summary"][recipe]["faults"] = study.faults;
  }
  evaluation["handovers"] = {{"clips", handovers.clips.size()},
                             {"found_with_object", handovers.found_with_object},
                             {"found_without_object", handovers.found_without_object}};
  return evaluation;
}

// The list's jobs: clip, object and the options of a fit that have to do with them.
std::vector<FitCommand> ReadFitJobs(const fs::path& list) {
  std::vector<FitCommand> jobs;
  for (const JobLine& line : ReadJobList(list)) {
    FitCommand& job = jobs.emplace_back();
    CLI::App command;
    command.add_option("clip", job.job.clip);
    command.add_option("object", job.job.object);
    AddFitOptions(command, job,
                  {"hand_over", "switch_frames", "first_hand", "max_switches", "dwell_s"});
    ParseJob(command, JobArguments(command, line), line.where);
    const double scale = job.job.carry.object_scale;
    if (!(scale >= 1e-6 && scale <= 1e6)) {
      throw Error(line.where, "object-scale is not within 1e-6 and 1e6",
                  "Write it like object-scale=0.001");
    }
    job.output = line.name;
  }
  return jobs;
}

}  // namespace

Outcome EvaluateFit(const fs::path& list, const fs::path& folder, int handovers,
                    const CommonOptions& common) {
  const std::vector<FitCommand> jobs = ReadFitJobs(list);
  fs::create_directories(folder);
  std::map<std::string, Study> studies;
  Progress progress(common, "evaluate");
  std::optional<nlohmann::json> clips = FitByAllRecipes(jobs, folder, common, progress, studies);
  if (!clips) return {kInterrupted, {}, {}};
  HandoverStudyOptions study_options;
  study_options.count = handovers;
  study_options.threads = NumThreads(common);
  const HandoverStudy study = RunHandoverStudy(LoadBody(""), study_options);

  const std::string table = Table(studies, study);
  nlohmann::json evaluation = FitEvaluationJson(studies, std::move(*clips), study, common);
  WriteAtomically(folder / "evaluation.json", JsonText(evaluation, 1) + "\n");
  WriteAtomically(folder / "evaluation.md", table);

  Outcome outcome;
  bool faults = false;
  for (const auto& [recipe, one] : studies) faults |= !one.faults.empty();
  outcome.exit_code = faults ? kInputFault : kDone;
  outcome.summary = std::move(evaluation);
  outcome.text =
      fmt::format("{} clips, {} synthetic hand-overs; all results in {}\n\n{}", jobs.size(),
                  handovers, folder.string(), table + "\n" + TimesText(studies));
  return outcome;
}

}  // namespace holdfast::apps
