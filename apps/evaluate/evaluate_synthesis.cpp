// SPDX-License-Identifier: MIT
#include "apps/evaluate/evaluate_synthesis.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/clip_input.h"
#include "apps/evaluate/evaluate_synthesis_page.h"
#include "generator/imos/action_set.h"
#include "generator/imos/synthesis_network.h"
#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/json_file.h"
#include "solver/evaluation/synthesis/synthesis_study.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

struct EvaluateSynthesisOptions {
  std::vector<std::string> data;             ///< folders of action clips
  std::vector<std::string> held_out{"s10"};  ///< subjects that are evaluated
  std::vector<std::string> weights;          ///< "NAME=FILE"
  std::string recognizer;                    ///< file
  std::vector<std::string> objects{"given", "fitted"};
  std::vector<std::string> without;  ///< actions to leave out
  std::string key_frames = "whole";
  int at_most = 0;  ///< sequences, evenly over all; 0: all
  SynthesisStudyOptions study;
  std::string output;
};

std::vector<RatedNetwork> NetworksOf(const std::vector<std::string>& told,
                                     const CommonOptions& common) {
  std::vector<RatedNetwork> networks;
  std::set<std::string> names{"real", "clip", "still"};
  networks.reserve(told.size());
  for (const std::string& text : told) {
    const std::size_t equals = text.find('=');
    const std::string name = text.substr(0, equals);
    const auto is_plain = [](std::string_view part) {
      return !part.empty() && std::ranges::all_of(part, [](unsigned char c) {
        return std::isalnum(c) != 0 || c == '-' || c == '.';
      });
    };
    const std::size_t at = name.find('@');  // the seed of a training follows
    const bool plain = is_plain(std::string_view(name).substr(0, at)) &&
                       (at == std::string::npos || is_plain(std::string_view(name).substr(at + 1)));
    if (equals == std::string::npos || !plain) {
      throw Error(
          "--weights " + text, "is not NAME=FILE",
          "Give full=FILE, random-embeddings=FILE, no-attention=FILE, one-module=FILE, or "
          "a name of letters, digits, '-' and '.'; '@2' after it for seed 2 of the training");
    }
    if (!names.insert(name).second) {
      throw Error("--weights " + text, fmt::format("'{}' is the name of another row", name),
                  "Give each network a name of its own");
    }
    networks.emplace_back(name, LoadSynthesisNetwork(text.substr(equals + 1)));
    WarnOfOldPelvis(text, networks.back().loaded.weights.notes, common);
  }
  return networks;
}

std::vector<SynthesisCase> CasesOf(const EvaluateSynthesisOptions& options,
                                   const CommonOptions& common) {
  const imos::KeyFrameRule rule =
      options.key_frames == "paper" ? imos::KeyFrameRule::kPaper : imos::KeyFrameRule::kWhole;
  imos::ActionSetOptions what;
  what.sequences.rule = rule;
  what.split = {{}, options.held_out};
  what.without = options.without;
  what.threads = NumThreads(common);
  imos::ActionSet set = [&] {
    Progress progress(common, "reading clips");
    return imos::ReadActionSet({options.data.begin(), options.data.end()}, LoadBody(""), what,
                               [&](int done, int total) { progress.Update(done, total); });
  }();
  if (set.test.empty()) {
    std::set<std::string> there;
    for (const imos::ActionSequence& one : set.train) there.insert(one.subject);
    throw Error(fmt::format("--held-out {}", fmt::join(options.held_out, ",")),
                "no clip is of these subjects",
                fmt::format("Those of the data are {}", fmt::join(there, ", ")));
  }
  std::vector<imos::ActionSequence>& chosen = set.test;
  if (options.at_most > 0 && static_cast<int>(chosen.size()) > options.at_most) {
    const std::size_t all = chosen.size(), some = static_cast<std::size_t>(options.at_most);
    for (std::size_t i = 0; i < some; ++i) chosen[i] = chosen[i * all / some];
    chosen.resize(some);
  }
  CommonOptions quiet = common;
  quiet.quiet = true;
  ClipInputOptions shared;
  shared.loaded_body = LoadBody("");
  std::vector<SynthesisCase> cases;
  for (imos::ActionSequence& sequence : chosen) {
    const std::string source = sequence.source;
    ClipInput input = LoadClipInput(source, shared, quiet);
    if (!input.object) {
      throw Error(source, input.object_missing, "Put the mesh where the clip says");
    }
    if (auto one = SynthesisCaseOf(std::move(sequence), std::move(input), rule)) {
      cases.push_back(std::move(*one));
    } else {
      Note(common, fmt::format("{}: nobody holds the object in key frame {}: left out", source,
                               imos::kHistory));
    }
  }
  if (cases.empty()) {
    throw Error(fmt::format("{}", fmt::join(options.data, ", ")),
                "in no held-out clip is the object held in the seed's last key frame",
                "Give clips that begin with the object in a hand");
  }
  return cases;
}

std::vector<std::string> NotesOf(const EvaluateSynthesisOptions& options,
                                 const imos::RecognizerWeights& recognizer,
                                 const std::vector<SynthesisCase>& cases,
                                 const SynthesisSummary& real) {
  std::set<std::string> subjects;
  for (const SynthesisCase& one : cases) subjects.insert(one.sequence.subject);
  const auto note = [&](const char* key) {
    const auto found = recognizer.notes.find(key);
    return found == recognizer.notes.end() ? std::string("not told") : found->second;
  };
  return {
      fmt::format("{} held-out sequences of {} ({}), {} key frames, the first {} given; {} repeats "
                  "with 95 % intervals (1.96 standard errors).",
                  cases.size(), fmt::join(subjects, ", "), fmt::join(options.data, ", "),
                  imos::kNumKeyFrames, imos::kHistory, options.study.repeats),
      fmt::format("Hand and object are measured in {} of them, evenly spread, once each.",
                  std::min<std::size_t>(options.study.object_cases, cases.size())),
      fmt::format("Recognition network {}: {:.1f} % of these sequences' real motion recognized; "
                  "trained without {}, accuracy held out then {}.",
                  options.recognizer, 100.0 * real.accuracy.mean, note("held_out"),
                  note("accuracy, held out")),
      "Both definitions are given because the authors' code measures other things than the names "
      "say: its AVE grows with where a motion is, its FID is a mean of distances of single pairs, "
      "its multimodality counts actions that never occur as zero. See docs/metrics.md, Synthesis.",
      "'Last given pose, held' does nothing at all after the seed: what is not clearly better has "
      "learned nothing that this column can see."};
}

nlohmann::json EvaluationJson(const EvaluateSynthesisOptions& options, const CommonOptions& common,
                              const std::vector<std::string>& notes,
                              const imos::RecognizerWeights& weights,
                              const std::vector<SynthesisCase>& cases,
                              const std::vector<SynthesisResult>& results,
                              const std::vector<ObjectMode>& modes) {
  nlohmann::json json = JsonHead("holdfast/evaluate-synthesis/1", common);
  json["notes"] = notes;
  json["data"] = options.data;
  json["held_out"] = options.held_out;
  json["key_frames"] = options.key_frames;
  json["recognizer"] = {{"weights", options.recognizer}, {"notes", weights.notes}};
  for (const SynthesisCase& one : cases) {
    json["sequences"].push_back(one.sequence.subject + "/" + one.sequence.name);
  }
  for (const SynthesisResult& result : results) json["rows"].push_back(SynthesisJson(result));
  json["paper"] = PaperSynthesisJson();
  for (const ObjectMode mode : modes)
    json["order"][ObjectModeName(mode)] = OrderOfRows(results, mode);
  return json;
}

Outcome EvaluateSynthesis(const EvaluateSynthesisOptions& options, const CommonOptions& common) {
  const std::vector<RatedNetwork> networks = NetworksOf(
      options.weights.empty() ? std::vector<std::string>{"full="} : options.weights, common);
  std::vector<ObjectMode> modes;
  for (const std::string& name : options.objects) {
    for (const ObjectMode mode : {ObjectMode::kGiven, ObjectMode::kCarried, ObjectMode::kFitted}) {
      if (ObjectModeName(mode) == name) modes.push_back(mode);
    }
  }
  const imos::RecognizerWeights weights = imos::ReadRecognizer(options.recognizer);
  WarnOfOldPelvis(options.recognizer, weights.notes, common);
  const imos::Recognizer recognizer(weights, options.recognizer);
  const std::vector<SynthesisCase> cases = CasesOf(options, common);

  SynthesisStudyOptions asked = options.study;
  asked.seed = common.seed;
  asked.threads = NumThreads(common);
  asked.force = common.force;
  SynthesisStudy study(options.output, cases, recognizer,
                       Checksum(ByteSource{fs::path(options.recognizer)}), asked, Interrupted);
  const std::vector<SynthesisRow> rows = SynthesisRows(networks, modes);
  const auto [total, left] = study.Count(rows);
  if (left < total) {
    Note(common, fmt::format("{} of {} motions are there already", total - left, total));
  }
  const std::vector<SynthesisResult> results = [&, to_make = left] {
    Progress progress(common, "evaluate synthesis");
    return study.Run(rows, [&](int made) { progress.Update(made, to_make); });
  }();
  if (results.empty()) return {kInterrupted, {}, {}};

  if (const double known = results[0].summary.accuracy.mean; known < 0.7) {
    Note(common,
         fmt::format(
             "the action classifier recognizes {:.0f} % of the real motions: nothing that is "
             "measured through it means much",
             100.0 * known));
  }
  const std::vector<std::string> notes = NotesOf(options, weights, cases, results[0].summary);
  const std::vector<TextTable> tables = SynthesisTables(results, modes);
  nlohmann::json json = EvaluationJson(options, common, notes, weights, cases, results, modes);
  const std::string markdown = SynthesisMarkdown(tables, results, modes);
  const fs::path folder = options.output;
  WriteWithoutWallTimes(json, folder / "results.json", folder / "timing.json");
  WriteAtomically(folder / "results.md", markdown);
  WriteAtomically(folder / "report.html", SynthesisPage(notes, tables, results, modes));
  Outcome outcome;
  outcome.summary = std::move(json);
  outcome.summary["output"] = options.output;
  outcome.text = fmt::format(
      "{} motions, {} of them made now; results.json, results.md, "
      "report.html in {}\n\n{}\n{}",
      total, left, options.output, markdown, SynthesisTimes(results));
  return outcome;
}

}  // namespace

void AddEvaluateSynthesis(CLI::App& evaluate, int& exit_code) {
  struct Options {
    CommonOptions common;
    EvaluateSynthesisOptions synthesis;
  };
  auto options = std::make_shared<Options>();
  EvaluateSynthesisOptions& synthesis = options->synthesis;
  CLI::App* command =
      evaluate.add_subcommand("synthesis",
                              "Run IMoS's Table 2 with its ablations, by its definitions and the "
                              "field's, with contact metrics of hand and object");
  command->add_option("--data", synthesis.data, "Folders of action clips, as of 'make-actions'")
      ->required();
  command->add_option("--held-out", synthesis.held_out, "Subjects to evaluate, none trained on")
      ->delimiter(',')
      ->capture_default_str();
  command
      ->add_option(
          "--weights", synthesis.weights,
          "NAME=FILE, NAME one of full, random-embeddings, no-attention, one-module, or "
          "of your own; several are rows of one table. NAME@2=FILE: the same trained from seed 2; "
          "means over seeds are rows too. Without a FILE, or without "
          "--weights as 'full': the embedded network")
      ->required(!imos::HasDefaultNetwork());
  command
      ->add_option("--recognizer", synthesis.recognizer,
                   "The action classifier, from 'train recognizer'")
      ->required();
  command
      ->add_option("--objects", synthesis.objects,
                   "Object poses in generated motion: given (ground truth, as published), carried "
                   "(fixed to the wrist), fitted (the whole loop)")
      ->delimiter(',')
      ->capture_default_str()
      ->check(CLI::IsMember({"given", "carried", "fitted"}));
  command->add_option("--without", synthesis.without, "Actions to leave out (as published: lift)")
      ->delimiter(',');
  AddOption(*command, "--key-frames", synthesis.key_frames,
            "15 spread over the clip (whole), or over the contact as published (paper)",
            CLI::IsMember({"whole", "paper"}));
  AddOption(*command, "--repeats", synthesis.study.repeats,
            "Samples of each sequence, for the intervals", CLI::Range(1, 1000));
  AddOption(*command, "--fitted-repeats", synthesis.study.fitted_repeats,
            "The same with fitted objects. A larger number later reuses these",
            CLI::Range(1, 1000));
  AddOption(*command, "--object-cases", synthesis.study.object_cases,
            "Sequences, evenly over all, in which hand and object are measured, and fitted in "
            "all frames: a second each",
            CLI::Range(1, 1'000'000));
  command->add_option("--at-most", synthesis.at_most, "Sequences, evenly over all [0: all]")
      ->check(CLI::Range(0, 1'000'000));
  AddOption(*command, "--sigma", synthesis.study.sigma, "Standard deviation of the latents",
            CLI::Range(0.0, 3.0));
  command->add_flag("--keep-clips", synthesis.study.keep_clips,
                    "Write the clips that are measured");
  command
      ->add_option("-o,--output", synthesis.output,
                   "Folder for results.json, results.md, report.html and blocks; continued if it "
                   "exists")
      ->required();
  AddCommonOptions(
      *command, options->common, true,
      "  holdfast train recognizer actions -o recognizer.safetensors --held-out s9,s10\n"
      "  holdfast evaluate synthesis --data actions --held-out s9,s10 -o out/synthesis \\\n"
      "    --weights full=out/imos/best.safetensors --recognizer recognizer.safetensors\n");
  command->callback([options, &exit_code] {
    const Outcome outcome = EvaluateSynthesis(options->synthesis, options->common);
    if (!outcome.summary.is_null()) PrintResult(options->common, outcome.summary, outcome.text);
    exit_code = outcome.exit_code;
  });
}

}  // namespace holdfast::apps
