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
    text += fmt::format("; {:.2f} s per clip and thread", report.seconds / report.made);
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
  if (report.had > 0) text += fmt::format("  {} of them existed already\n", report.had);
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
    throw Error("--count", "is 0, and there are no captured clips",
                "Give a number of clips, or recordings with --captured");
  }
  PlanActions(options.set);  // reports errors before the search for starts
  PlanCaptured(options.set);
  const std::shared_ptr<const BodyModel> body = LoadBody(options.body);
  const ActionStarts starts =
      FindActionStarts(options.starts, options.held_out, *body, common.seed, options.set.threads);
  Note(common, fmt::format("{} standing poses for training, {} held out", starts.train.size(),
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
  CLI::App* command =
      app.add_subcommand("make-actions", "Generate a labeled data set of people using objects");
  command
      ->add_option("-o,--output", options->output,
                   "Output folder: s1/mug_drink_1.npz ..., manifest.json, grasps/; an unfinished "
                   "one is resumed, a finished one is extended")
      ->required();
  CLI::Option* count = AddOption(*command, "--count", options->set.count,
                                 "Number of scripted clips", CLI::Range(0, kMaxScripted));
  command->add_option("--hours", options->hours, "Approximate hours of motion, in place of --count")
      ->check(CLI::Range(0.001, 1000.0))
      ->excludes(count);
  AddOption(*command, "--subjects", options->set.subjects, "Number of people of different shapes",
            CLI::Range(2, 100));
  command->add_option("--actions", options->set.actions, "Only these actions: drink,eat,... [all]")
      ->delimiter(',');
  command->add_option("--objects", options->set.objects, "Only these embedded objects [all]")
      ->delimiter(',');
  AddOption(*command, "--left", options->set.left_share, "Fraction of left-handed subjects",
            CLI::Range(0.0, 1.0));
  command
      ->add_option_function<std::string>(
          "--blows",
          [options](const std::string& blows) { options->set.wrist_blows = blows == "wrist"; },
          "Hammer with the whole arm or only with the wrist; use wrist for training data, because "
          "key-frame networks can learn it [arm]")
      ->check(CLI::IsMember({"arm", "wrist"}));
  command->add_option("--starts", options->starts,
                      "Folder of captured clips (.npz, as written by 'holdfast import' or "
                      "'make-reach-data') to take standing poses from [built-in standing poses]");
  command->add_option("--captured", options->set.captured,
                      "Folder of marker recordings of drinking or combing, in any format that "
                      "'solve' reads, with one subfolder per person that includes a static trial "
                      "(..._static...). Each other trial adds two clips, seated and standing, with "
                      "captured arm and trunk motion");
  command
      ->add_option("--held-out", options->held_out,
                   "People in --starts whose poses are used only for held-out subjects (the last "
                   "fifth of --subjects) [people in a folder held_out, and the two with the fewest "
                   "poses]")
      ->delimiter(',');
  command->add_option("--body", options->body, "Body model: SMPL-X .npz [the embedded body]");
  AddCommonOptions(*command, options->common, true,
                   "  holdfast make-actions -o actions --count 2500 --starts reaches/captured\n"
                   "  holdfast make-actions -o few --count 20 --actions drink,call --seed 7\n"
                   "  holdfast make-actions -o both --count 20 --captured recordings\n"
                   "Actions: " +
                       ScriptedActionNames() +
                       ".\n"
                       "Names are GRAB's: SUBJECT/OBJECT_ACTION_NUMBER.npz. Every clip has an "
                       "object. manifest.json lists\n"
                       "dropped clips with the reasons.\n");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace holdfast::apps
