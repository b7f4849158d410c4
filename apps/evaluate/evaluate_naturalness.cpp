// SPDX-License-Identifier: MIT
#include "apps/evaluate/evaluate_naturalness.h"

#include <algorithm>
#include <filesystem>
#include <memory>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/evaluate/naturalness_page.h"
#include "apps/evaluate/naturalness_reaches.h"
#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/json_file.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

struct EvaluateNaturalnessOptions {
  CommonOptions common;
  std::vector<std::string> reference;  // captured clips, or folders of them
  // "LABEL=PATH" or "PATH": clips or folders; those of one label are one set.
  std::vector<std::string> against;
  std::vector<std::string> limits;  // captured motion whose joint limits hold; empty: reference
  std::string body;                 // body model; empty: the embedded one
  int at_most = 0;                  // of each set, spread evenly; 0: all
  std::string output;
  NaturalnessOptions study;
  NaturalnessReachOptions reaches;
};

std::string FolderName(const std::string& path) {
  fs::path name = fs::path(path).lexically_normal();
  if (!name.has_filename()) name = name.parent_path();
  return name.filename().string();
}

void AddFiles(MotionSet& set, const std::string& path) {
  const std::vector<MotionFile> files = MotionFilesOf(path);
  set.files.insert(set.files.end(), files.begin(), files.end());
}

// "LABEL=PATH", or a path that may have '=' in it. Sets come in the order they are named first.
std::vector<MotionSet> SetsOf(const EvaluateNaturalnessOptions& options) {
  std::vector<MotionSet> sets(1);
  sets[0].label = "captured";
  for (const std::string& path : options.reference) AddFiles(sets[0], path);
  for (const std::string& text : options.against) {
    const std::size_t equals = text.find('=');
    const bool labeled = equals != std::string::npos && !fs::exists(text);
    const std::string path = labeled ? text.substr(equals + 1) : text;
    const std::string label = labeled ? text.substr(0, equals) : FolderName(path);
    if (label.empty() || path.empty()) {
      throw Error("--against " + text, "names no set", "Give LABEL=FOLDER or a folder");
    }
    const auto known = std::ranges::find(sets, label, &MotionSet::label);
    if (known == sets.begin()) {
      throw Error("--against " + text, "has the name of the reference",
                  "Give it a name of its own: LABEL=" + path);
    }
    AddFiles(known == sets.end() ? sets.emplace_back(MotionSet{label, {}}) : *known, path);
  }
  if (options.at_most > 0) {
    for (MotionSet& set : sets) {
      const std::size_t all = set.files.size(), some = static_cast<std::size_t>(options.at_most);
      if (all <= some) continue;
      for (std::size_t i = 0; i < some; ++i) set.files[i] = set.files[i * all / some];
      set.files.resize(some);
    }
  }
  return sets;
}

Outcome EvaluateNaturalness(const EvaluateNaturalnessOptions& options) {
  const CommonOptions& common = options.common;
  const fs::path folder = options.output;
  RequireNewFolder(folder, common);
  std::vector<MotionSet> sets = SetsOf(options);
  NaturalnessOptions asked = options.study;
  asked.body = LoadBody(options.body);
  const NaturalnessReaches reaches =
      MakeNaturalnessReaches(options.reaches, asked.body, folder, common);
  if (reaches.stopped) return {kInterrupted, {}, {}};
  sets.insert(sets.end(), reaches.sets.begin(), reaches.sets.end());
  for (const std::string& path : options.limits) AddFiles(asked.limits, path);
  asked.limits.label = fmt::format("{}", fmt::join(options.limits, ", "));
  asked.seed = common.seed;
  asked.threads = NumThreads(common);
  Progress progress(common, "evaluate naturalness");
  asked.progress = [&](int done, int total) {
    if (done > 0) progress.Update(done, total);
    return !Interrupted();
  };
  const NaturalnessStudy study = CompareNaturalness(sets, asked);
  if (study.stopped) return {kInterrupted, {}, {}};

  Outcome outcome;
  outcome.summary = JsonHead("holdfast/evaluate-naturalness/1", common);
  outcome.summary.update(NaturalnessJson(study));
  if (!reaches.sets.empty()) {
    outcome.summary["reaches"] = reaches.json;
    outcome.summary["reaches_list"] = options.reaches.list;
  }
  const std::string table =
      NaturalnessTable(study) + (reaches.text.empty() ? "" : "\n" + reaches.text);
  fs::create_directories(folder);
  WriteAtomically(folder / "results.json", JsonText(outcome.summary, 1) + "\n");
  WriteAtomically(folder / "results.md", table);
  WriteAtomically(folder / "motions.csv", NaturalnessCsv(study));
  WriteAtomically(folder / "report.html", NaturalnessPage(study));
  outcome.summary["output"] = options.output;
  outcome.text = fmt::format("{}\nresults.json, results.md, motions.csv and report.html in {}\n",
                             table, options.output);
  return outcome;
}

}  // namespace

void AddEvaluateNaturalness(CLI::App& evaluate, int& exit_code) {
  auto options = std::make_shared<EvaluateNaturalnessOptions>();
  EvaluateNaturalnessOptions& what = *options;
  CLI::App* command = evaluate.add_subcommand(
      "naturalness", "Compare sets of motions with captured ones: gait, posture, smoothness");
  command
      ->add_option("reference", what.reference,
                   "Captured clips, or folders of them (with all below), that others are compared "
                   "with; best of people no network was trained on")
      ->required();
  command
      ->add_option("--against", what.against,
                   "LABEL=CLIP or LABEL=FOLDER (with all below): a set to compare, a column of the "
                   "table. Repeated: further sets, or more of one label")
      ->allow_extra_args(false);
  command
      ->add_option("--limits", what.limits,
                   "Captured clips, or folders of them, that joint limits are taken from; the "
                   "reference where left out")
      ->allow_extra_args(false);
  AddNaturalnessReachOptions(*command, what.reaches);
  command->add_option("--body", what.body, "Body model in place of the embedded one");
  AddOption(*command, "--way", what.study.least_way_m,
            "Meters that a motion's pelvis must get away for measures of walks",
            CLI::Range(0.0, 100.0));
  command->add_flag("--moving-only", what.study.moving_only,
                    "Leave motions that do not get that far out of all measures");
  command->add_flag("--hands", what.study.hands,
                    "How a hand gets to where it goes, too: speed, straightness, time to peak. For "
                    "who drinks, takes or reaches; with a mean of its own");
  AddOption(*command, "--at-most", what.at_most, "Motions of each set, spread evenly; 0: all",
            CLI::Range(0, 1'000'000));
  command
      ->add_option("-o,--output", what.output,
                   "Folder to make: results.json, results.md, "
                   "motions.csv, report.html")
      ->required();
  AddCommonOptions(
      *command, what.common, true,
      "  holdfast reach --goal 3,1,1.2 --samples 20 --all -o reached\n"
      "  holdfast evaluate naturalness reaches/captured/held_out --against reach=reached \\\n"
      "      -o out/natural\n"
      "  holdfast evaluate naturalness reaches/captured/held_out --at-most 200 \\\n"
      "      --against others=reaches/captured/train --against made=reaches/made \\\n"
      "      --limits reaches/captured/train -o out/natural_data\n"
      "Clips of another frame rate are resampled to "
      "30 Hz.\n");
  command->callback([options, &exit_code] {
    const Outcome outcome = EvaluateNaturalness(*options);
    if (!outcome.summary.is_null()) PrintResult(options->common, outcome.summary, outcome.text);
    exit_code = outcome.exit_code;
  });
}

}  // namespace holdfast::apps
