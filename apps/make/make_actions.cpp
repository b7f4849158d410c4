// SPDX-License-Identifier: MIT
#include <algorithm>
#include <chrono>
#include <map>

#include <fmt/format.h>

#include "apps/common.h"
#include "apps/make/action_set.h"
#include "apps/make/reach_manifest.h"
#include "generator/actions/action_catalog.h"
#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/read_json.h"
#include "geometry/parallel.h"
#include "geometry/seed.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct MakeActionsCommand {
  CommonOptions common;
  ActionSetOptions set;
  std::string output, starts, body;
  std::vector<std::string> held_out;
  double hours = 0.0;  // asked for; the count follows
};

constexpr double kSecondsPerClip = 4.2;  // about, for --hours

json OptionsJson(const MakeActionsCommand& options) {
  return {{"subjects", options.set.subjects},
          {"left_share", options.set.left_share},
          {"actions", options.set.actions},
          {"objects", options.set.objects},
          {"starts", options.starts.empty() ? "own" : fs::path(options.starts).filename().string()},
          {"held_out", options.held_out}};
}

// What was kept and dropped, and why.
json SummaryOf(const std::map<int, json>& lines) {
  std::map<std::string, std::map<std::string, int>> actions;
  std::map<std::string, int> reasons, subjects;
  long frames = 0;
  int kept = 0, tries = 0;
  for (const auto& [index, line] : lines) {
    std::map<std::string, int>& action = actions[line.at("action").get<std::string>()];
    const bool is_kept = line.contains("file");
    ++action[is_kept ? "kept" : "given_up"];
    tries += is_kept ? 1 : 0;
    if (is_kept) {
      ++kept;
      ++subjects[line.at("subject").get<std::string>()];
      frames += line.at("frames").get<long>();
    }
    for (const json& dropped : line.value("tries_dropped", json::array())) {
      ++action["tries_dropped"];
      ++reasons[dropped.at("reason").get<std::string>()];
      ++tries;
    }
  }
  return {{"clips", kept},
          {"given_up", lines.size() - static_cast<std::size_t>(kept)},
          {"tries", tries},
          {"hours", static_cast<double>(frames) / 30.0 / 3600.0},
          {"by_action", actions},
          {"by_subject", subjects},
          {"tries_dropped_because", reasons}};
}

// Lines of an unfinished or shorter set that asked for the same, by index.
std::map<int, json> ClipsBefore(const fs::path& manifest, const json& head, bool force) {
  std::map<int, json> lines;
  if (!fs::exists(manifest)) return lines;
  const json before = ReadJson(manifest);
  const auto same = [&](const char* key) {
    return before.is_object() && before.contains(key) && before[key] == head[key];
  };
  if (!same("schema")) {
    throw Error(manifest.string(), "is not a manifest of 'make-actions'", "Choose another folder");
  }
  if (!same("seed") || !same("holdfast_version") || !same("options") || !same("body") ||
      !same("people") || !before.contains("clips")) {
    if (force) return lines;
    throw Error(manifest.string(), "is of other starts, options, seed or version",
                "Choose another folder, or give --force to make it anew");
  }
  return UseJson(manifest, [&] {
    for (const json& line : before["clips"]) lines[line.at("index").get<int>()] = line;
    SummaryOf(lines);  // all is there
    return lines;
  });
}

// Jobs that share subject, object and hand; in an order in which a set grows evenly.
std::vector<std::vector<ActionJob>> GroupsOf(const std::vector<ActionJob>& jobs,
                                             const std::map<int, json>& done, std::uint64_t seed) {
  std::map<std::tuple<int, std::string, bool>, std::vector<ActionJob>> groups;
  for (const ActionJob& job : jobs) {
    if (!done.contains(job.index)) groups[{job.subject, job.object, job.left}].push_back(job);
  }
  std::vector<std::vector<ActionJob>> list;
  for (auto& [key, group] : groups) list.push_back(std::move(group));
  std::ranges::sort(list, {}, [&](const std::vector<ActionJob>& group) {
    return MixSeed(seed, static_cast<std::uint64_t>(group.front().index));
  });
  return list;
}

void WriteManifest(const fs::path& path, json head, const std::map<int, json>& lines) {
  head["summary"] = SummaryOf(lines);
  std::vector<json> list;
  for (const auto& [index, line] : lines) list.push_back(line);
  WriteAtomically(path, ManifestText(head, list));
}

std::string TextOf(const std::string& output, const json& summary, double seconds, int made) {
  std::string text = fmt::format("{}: {} clips, {:.2f} hours", output, summary["clips"].get<int>(),
                                 summary["hours"].get<double>());
  if (made > 0) text += fmt::format("; {:.2f} s a clip and thread", seconds / made);
  text +=
      fmt::format("\n  {:<14}{:>6}{:>10}{:>16}\n", "action", "kept", "given up", "tries dropped");
  for (const auto& [action, counts] : summary["by_action"].items()) {
    text += fmt::format("  {:<14}{:>6}{:>10}{:>16}\n", action, counts.value("kept", 0),
                        counts.value("given_up", 0), counts.value("tries_dropped", 0));
  }
  for (const auto& [reason, count] : summary["tries_dropped_because"].items()) {
    text += fmt::format("  dropped: {:<34}{:>6}\n", reason, count.get<int>());
  }
  return text;
}

int Run(MakeActionsCommand options) {
  const CommonOptions& common = options.common;
  if (options.hours > 0.0) {
    options.set.count = std::max(1, static_cast<int>(options.hours * 3600.0 / kSecondsPerClip));
  }
  const fs::path folder = options.output;
  const std::vector<ActionJob> jobs = PlanActions(options.set, common.seed);
  const std::shared_ptr<const BodyModel> body = LoadBody(options.body);
  ActionStarts starts = FindActionStarts(options.starts, options.held_out, *body, common);
  Note(common, fmt::format("{} moments of standing to learn from, {} held out", starts.train.size(),
                           starts.held_out.size()));
  json head = JsonHead("holdfast/actions/1", common);
  head["options"] = OptionsJson(options);
  head["body"] = body->Name();
  head["people"] = {{"train", starts.train_people}, {"held_out", starts.held_out_people}};
  head["note"] = "Synthetic: made by holdfast make-actions, no capture of anybody who acts";
  for (int s = 0; s < options.set.subjects; ++s) {
    const Eigen::VectorXd betas = SubjectBetas(s, body->NumShape(), common.seed);
    head["subjects"][fmt::format("s{}", s + 1)] = {
        {"split", IsHeldOut(s, options.set.subjects) ? "held_out" : "train"},
        {"betas", std::vector<double>(betas.begin(), betas.end())}};
  }
  const fs::path manifest = folder / "manifest.json";
  std::map<int, json> lines = ClipsBefore(manifest, head, common.force);
  const int had = static_cast<int>(lines.size());
  UseJson(manifest, [&] {
    std::erase_if(lines, [&](const auto& line) {
      return line.second.contains("file") &&
             !fs::exists(folder / line.second.at("file").template get<std::string>());
    });
  });
  std::error_code error;
  fs::create_directories(folder / "grasps", error);
  for (int s = 0; s < options.set.subjects; ++s) {
    fs::create_directories(folder / fmt::format("s{}", s + 1), error);
  }
  if (!fs::is_directory(folder / "grasps")) {
    throw Error(options.output, "is not a folder that can be created", "Choose another place");
  }

  ActionWorkshop workshop(body, std::move(starts), options.set, folder, common.seed);
  const std::vector<std::vector<ActionJob>> groups = GroupsOf(jobs, lines, common.seed);
  const auto begin = std::chrono::steady_clock::now();
  Progress progress(common, "clips");
  std::mutex lock;
  int made = 0;
  int waiting = 0;
  for (const std::vector<ActionJob>& group : groups) waiting += static_cast<int>(group.size());
  ParallelFor(static_cast<int>(groups.size()), NumThreads(common), [&](int g) {
    if (Interrupted()) return;
    const std::vector<json> some = workshop.Make(groups[static_cast<std::size_t>(g)]);
    const std::scoped_lock guard(lock);
    for (const json& line : some) lines[line["index"].get<int>()] = line;
    made += static_cast<int>(some.size());
    head["complete"] = false;
    WriteManifest(manifest, head, lines);
    progress.Update(made, waiting);
  });
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() *
      std::min(NumThreads(common), std::max(1, static_cast<int>(groups.size())));
  if (Interrupted()) return kInterrupted;
  head["complete"] = true;
  WriteManifest(manifest, head, lines);
  const json summary = SummaryOf(lines);
  if (summary["clips"].get<int>() == 0) {
    throw FitFailure(
        fmt::format("{}: no clip could be made; see why in {}", options.output, manifest.string()));
  }
  head["summary"] = summary;
  head["output"] = options.output;
  std::string text = TextOf(options.output, summary, seconds, made);
  if (had > 0) text += fmt::format("  {} of them were there already\n", had);
  PrintResult(common, head, text);
  return kDone;
}

}  // namespace

void AddMakeActionsCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<MakeActionsCommand>();
  CLI::App* command = app.add_subcommand(
      "make-actions", "Generate a labelled set of people doing things with objects");
  command
      ->add_option("-o,--output", options->output,
                   "Folder to write: s1/mug_drink_1.npz ..., manifest.json, grasps/; an unfinished "
                   "one is resumed, a finished one extended")
      ->required();
  CLI::Option* count = command->add_option("--count", options->set.count, "Clips")
                           ->capture_default_str()
                           ->check(CLI::Range(1, 1'000'000));
  command->add_option("--hours", options->hours, "Approximate hours of motion, in place of --count")
      ->check(CLI::Range(0.001, 1000.0))
      ->excludes(count);
  command->add_option("--subjects", options->set.subjects, "People of different shapes")
      ->capture_default_str()
      ->check(CLI::Range(2, 100));
  command->add_option("--actions", options->set.actions, "Only these: drink,eat,... [all]")
      ->delimiter(',');
  command->add_option("--objects", options->set.objects, "Only with these embedded objects [all]")
      ->delimiter(',');
  command->add_option("--left", options->set.left_share, "Share of left-handed subjects")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1.0));
  command->add_option("--starts", options->starts,
                      "Folder of captured clips (.npz, as 'holdfast import' or 'make-reach-data' "
                      "write them) with people who stand [standing poses of Holdfast's own]");
  command
      ->add_option("--held-out", options->held_out,
                   "People of --starts for the held-out subjects (the last fifth) [those in a "
                   "folder held_out, and the two with the fewest starts]")
      ->delimiter(',');
  command->add_option("--body", options->body, "SMPL-X .npz [the embedded body]");
  AddCommonOptions(*command, options->common, true,
                   "  holdfast make-actions -o actions --count 2500 --starts reaches/captured\n"
                   "  holdfast make-actions -o few --count 20 --actions drink,call --seed 7\n"
                   "Actions: " +
                       MadeActionNames() +
                       ".\nNames are GRAB's: SUBJECT/OBJECT_ACTION_NUMBER.npz. Every clip is a "
                       "clip with object; what was dropped\nand why is in manifest.json.\n");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace holdfast::apps
