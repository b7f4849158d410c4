// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <chrono>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/clip_input.h"
#include "apps/common.h"
#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/json_file.h"
#include "solver/score/score_output.h"
#include "solver/trial/trial_clip.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

struct ScoreCommand {
  CommonOptions common;
  ClipInputOptions input;
  ScoreOptions score;
  std::vector<std::string> clips;
  std::vector<std::string> references;
  std::string output;
  std::string csv;
  bool per_frame = false;
  bool physics = false;
};

// Files that other commands write next to results: lists of jobs, tables, pages, pictures. A shell
// pattern such as fits/* includes them.
bool IsBesideResults(const fs::path& path) {
  constexpr std::array<std::string_view, 6> kWritten = {".csv", ".html", ".png",
                                                        ".gif", ".mp4",  ".txt"};
  if (!fs::is_regular_file(path)) return false;
  if (path.extension() != ".json") return std::ranges::count(kWritten, path.extension()) > 0;
  const nlohmann::json json = ReadJson(path);
  if (!json.is_object() || !json.contains("schema") || !json["schema"].is_string()) return false;
  return json["schema"].get_ref<const std::string&>().starts_with("holdfast/");
}

// Replaces a folder that is not a result by the results in it. Other clips are unchanged.
std::vector<std::string> ExpandFolders(const std::vector<std::string>& given,
                                       const CommonOptions& common) {
  std::vector<std::string> clips, beside;
  for (const std::string& path : given) {
    if (given.size() > 1 && IsBesideResults(path)) {
      beside.push_back(path);
      continue;
    }
    if (!fs::is_directory(path) || fs::exists(fs::path(path) / "clip.npz")) {
      clips.push_back(path);
      continue;
    }
    std::vector<std::string> inside;
    for (const auto& entry : fs::directory_iterator(path)) {
      const bool result = entry.is_directory() && fs::exists(entry.path() / "clip.npz");
      const bool clip = entry.is_regular_file() && entry.path().extension() == ".npz";
      if (result || clip) inside.push_back(entry.path().string());
    }
    if (inside.empty()) inside.push_back(path);  // a clip with one file per frame
    std::ranges::sort(inside);
    clips.insert(clips.end(), inside.begin(), inside.end());
  }
  if (clips.empty()) return beside;  // reading the first reports that it is not a clip
  if (!beside.empty()) {
    Note(common, fmt::format("note: not a clip, ignored: {}", fmt::join(beside, ", ")));
  }
  return clips;
}

// Adds each clip's trial to the JSON of its scores; returns the lines of text.
std::string AddTrials(std::span<const std::optional<ClipTrial>> trials,
                      std::span<const ClipScore> scores, nlohmann::json& json) {
  std::string text;
  json["protocol"]["hold_trial"] = TrialProtocolJson({});
  for (std::size_t c = 0; c < trials.size(); ++c) {
    json["clips"][c]["hold_trial"] = trials[c] ? TrialJson(*trials[c]) : nlohmann::json(nullptr);
    text +=
        fmt::format("{}: {}\n", scores[c].source,
                    trials[c] ? TrialText(*trials[c])
                              : "not simulated: no frame has exactly one hand holding an object");
  }
  return text;
}

int Run(ScoreCommand options) {
  const CommonOptions& common = options.common;
  if (options.physics) RequirePhysics();
  for (const std::string& path : {options.output, options.csv}) {
    if (!path.empty()) RequireNew(path, common);
  }
  const std::vector<std::string> clips = ExpandFolders(options.clips, common);
  const std::vector<std::string> references = ExpandFolders(options.references, common);
  if (references.size() > 1 && references.size() != clips.size()) {
    throw Error(
        "--reference",
        fmt::format("has {} clips, but {} clips are scored", references.size(), clips.size()),
        "Give one reference for all clips, or one per clip in the same order");
  }
  ScoreOptions& score = options.score;
  score.threads = NumThreads(common);
  SettleScoreOptions(score);
  std::vector<ClipScore> scores;
  std::vector<std::optional<ClipTrial>> trials;
  int frames = 0;
  const auto begin = std::chrono::steady_clock::now();
  Progress progress(common, "score");
  std::optional<ClipInput> shared_reference;
  for (std::size_t c = 0; c < clips.size(); ++c) {
    std::optional<ClipInput> own_reference;
    const ClipInput* reference = nullptr;
    if (references.size() == 1) {
      if (!shared_reference) {
        shared_reference = LoadClipInput(references[0], options.input, common);
      }
      reference = &*shared_reference;
    } else if (!references.empty()) {
      reference = &own_reference.emplace(LoadClipInput(references[c], options.input, common));
    }
    const ClipInput input = LoadClipInput(clips[c], options.input, common);
    StageProgress hands(common);
    scores.push_back(
        ScoreClip(input, reference, score, [&](const char* stage, int done, int total) {
          hands.Update((input.source + ", " + stage).c_str(), done, total);
          return !Interrupted();
        }));
    hands.End();
    if (Interrupted()) return kInterrupted;
    if (options.physics) {
      TrialProtocol protocol_of_trial;
      protocol_of_trial.threads = score.threads;
      trials.push_back(TryClip(input, protocol_of_trial));
    }
    frames += scores.back().frames;
    if (clips.size() > 1) progress.Update(static_cast<int>(c + 1), static_cast<int>(clips.size()));
  }
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();

  nlohmann::json json = JsonHead("holdfast/score/1", common);
  AddScores(scores, score, options.per_frame, json);
  const std::string tried = options.physics ? AddTrials(trials, scores, json) : "";
  if (!options.output.empty()) WriteAtomically(options.output, JsonText(json, 1) + "\n");
  if (!options.csv.empty()) WriteAtomically(options.csv, ScoreCsv(scores, score));
  PrintResult(common, json, ScoreTable(scores, score) + tried);
  Note(common, fmt::format("scored {} frames in {:.1f} s ({:.0f} per second)", frames, seconds,
                           frames / std::max(seconds, 1e-9)));
  return kDone;
}

}  // namespace

void AddScoreCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ScoreCommand>();
  CLI::App* command = app.add_subcommand(
      "score", "Measure clips: penetration, contact, slip, jitter, and errors against a reference");
  command
      ->add_option("clips", options->clips,
                   "Clips (.npz), result folders, folders of these, embedded clips, or files that "
                   "'holdfast import' reads")
      ->required();
  command->add_option("-r,--reference", options->references,
                      "Ground truth motion to compare with: one for all clips, or one for each");
  command->add_option("-o,--output", options->output, "Write the scores as JSON");
  command->add_option("--csv", options->csv, "Write a table with one line per clip");
  command->add_flag(
      "--physics", options->physics,
      "Also simulate the hold (needs MuJoCo): gravity in six directions, and the clip's motion");
  command->add_flag("--per-frame", options->per_frame, "Add every frame's values to the JSON");
  AddOptions(*command, OptionsOf(options->score));
  AddClipInputOptions(*command, options->input);
  AddCommonOptions(*command, options->common, true,
                   "  holdfast score held\n"
                   "  holdfast score held --protocol grab\n"
                   "  holdfast score fits/* --csv table.csv -o scores.json\n"
                   "  holdfast score held --reference captured.npz --json --per-frame\n");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace holdfast::apps
