// SPDX-License-Identifier: MIT
#include <algorithm>

#include <fmt/format.h>

#include "apps/common.h"
#include "generator/actions/action_catalog.h"
#include "geometry/error.h"
#include "solver/actions/make_action_set.h"

namespace holdfast::apps {
namespace {

using nlohmann::json;

struct MakeActionsCommand {
  CommonOptions common;
  ActionSetOptions set;
  std::string output, starts, body;
  std::vector<std::string> held_out;
  double hours = 0.0;  // determines the count if given
};

constexpr double kSecondsPerClip = 4.2;  // approximate, for --hours

std::string TextOf(const std::string& output, const ActionSetReport& report) {
  const json& summary = report.head["summary"];
  std::string text = fmt::format("{}: {} clips, {:.2f} hours", output, summary["clips"].get<int>(),
                                 summary["hours"].get<double>());
  if (report.made > 0) {
    text += fmt::format("; {:.2f} s a clip and thread", report.seconds / report.made);
  }
  text +=
      fmt::format("\n  {:<14}{:>6}{:>10}{:>16}\n", "action", "kept", "given up", "tries dropped");
  for (const auto& [action, counts] : summary["by_action"].items()) {
    text += fmt::format("  {:<14}{:>6}{:>10}{:>16}\n", action, counts.value("kept", 0),
                        counts.value("given_up", 0), counts.value("tries_dropped", 0));
  }
  for (const auto& [reason, count] : summary["tries_dropped_because"].items()) {
    text += fmt::format("  dropped: {:<34}{:>6}\n", reason, count.get<int>());
  }
  if (summary.contains("captured")) {
    text += fmt::format("  {} of {} captured clips kept\n", summary["captured"]["clips"].get<int>(),
                        summary["captured"]["of"].get<int>());
  }
  if (report.had > 0) text += fmt::format("  {} of them were there already\n", report.had);
  return text;
}

int Run(MakeActionsCommand options) {
  const CommonOptions& common = options.common;
  if (options.hours > 0.0) {
    options.set.count = std::max(1, static_cast<int>(options.hours * 3600.0 / kSecondsPerClip));
  }
  options.set.seed = common.seed;
  options.set.threads = NumThreads(common);
  options.set.replace = common.force;
  options.set.version = HOLDFAST_VERSION;
  if (options.set.count == 0 && options.set.captured.empty()) {
    throw Error("--count", "is 0, and there is nothing captured to make clips of",
                "Give a number of clips, or --captured");
  }
  PlanActions(options.set);  // reports errors before the search for starts
  PlanCaptured(options.set);
  const std::shared_ptr<const BodyModel> body = LoadBody(options.body);
  const ActionStarts starts =
      FindActionStarts(options.starts, options.held_out, *body, common.seed, options.set.threads);
  Note(common, fmt::format("{} moments of standing to learn from, {} held out", starts.train.size(),
                           starts.held_out.size()));
  StageProgress progress(common);
  ActionSetReport report = MakeActionSet(body, starts, options.output, options.set,
                                         [&](const char* stage, int done, int total) {
                                           progress.Update(stage, done, total);
                                           return !Interrupted();
                                         });
  if (!report.complete) return kInterrupted;
  if (report.head["summary"]["clips"] == 0) {
    throw FitFailure(
        fmt::format("{}: no clip could be made; see why in {}", options.output,
                    (std::filesystem::path(options.output) / "manifest.json").string()));
  }
  report.head["output"] = options.output;
  PrintResult(common, report.head, TextOf(options.output, report));
  return kDone;
}

}  // namespace

void AddMakeActionsCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<MakeActionsCommand>();
  CLI::App* command = app.add_subcommand(
      "make-actions", "Generate a labeled set of people doing things with objects");
  command
      ->add_option("-o,--output", options->output,
                   "Folder to write: s1/mug_drink_1.npz ..., manifest.json, grasps/; an unfinished "
                   "one is resumed, a finished one extended")
      ->required();
  CLI::Option* count = AddOption(*command, "--count", options->set.count, "Scripted clips",
                                 CLI::Range(0, kMaxScripted));
  command->add_option("--hours", options->hours, "Approximate hours of motion, in place of --count")
      ->check(CLI::Range(0.001, 1000.0))
      ->excludes(count);
  AddOption(*command, "--subjects", options->set.subjects, "People of different shapes",
            CLI::Range(2, 100));
  command->add_option("--actions", options->set.actions, "Only these: drink,eat,... [all]")
      ->delimiter(',');
  command->add_option("--objects", options->set.objects, "Only with these embedded objects [all]")
      ->delimiter(',');
  AddOption(*command, "--left", options->set.left_share, "Share of left-handed subjects",
            CLI::Range(0.0, 1.0));
  command
      ->add_option_function<std::string>(
          "--blows",
          [options](const std::string& blows) { options->set.wrist_blows = blows == "wrist"; },
          "Hammering by the whole arm, or by the wrist alone, which networks of key frames can "
          "follow: for their training [arm]")
      ->check(CLI::IsMember({"arm", "wrist"}));
  command->add_option("--starts", options->starts,
                      "Folder of captured clips (.npz, as 'holdfast import' or 'make-reach-data' "
                      "write them) with people who stand [standing poses of Holdfast's own]");
  command->add_option("--captured", options->set.captured,
                      "Folder of recorded markers with people who drink or comb, as 'solve' reads "
                      "them, a folder a person, each with a ..._static... trial: two clips more of "
                      "each trial, seated and standing, with arms and trunk as captured");
  command
      ->add_option("--held-out", options->held_out,
                   "People of --starts for the held-out subjects (the last fifth) [those in a "
                   "folder held_out, and the two with the fewest starts]")
      ->delimiter(',');
  command->add_option("--body", options->body, "SMPL-X .npz [the embedded body]");
  AddCommonOptions(*command, options->common, true,
                   "  holdfast make-actions -o actions --count 2500 --starts reaches/captured\n"
                   "  holdfast make-actions -o few --count 20 --actions drink,call --seed 7\n"
                   "  holdfast make-actions -o both --count 20 --captured recordings\n"
                   "Actions: " +
                       ScriptedActionNames() +
                       ".\nNames are GRAB's: SUBJECT/OBJECT_ACTION_NUMBER.npz. Every clip is a "
                       "clip with object; what was dropped\nand why is in manifest.json.\n");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace holdfast::apps
