// SPDX-License-Identifier: MIT
#include "apps/evaluate/evaluate_handovers.h"

#include <fmt/format.h>

#include "apps/clip_input.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/json_file.h"
#include "geometry/io/mesh/load_object.h"
#include "geometry/rotation.h"
#include "solver/evaluation/handover_study.h"
#include "solver/evaluation/pass_study.h"

namespace holdfast::apps {
namespace {

struct HandoversCommand {
  CommonOptions common;
  std::vector<std::string> objects = {"apple",     "bottle", "cube", "mug",
                                      "wineglass", "teapot", "bowl", "hammer"};
  std::string clip = "demo_pass", output;
  bool keep_motion = false, one_way = false;
  int found = 120;  // synthetic hand-overs to be found
};

std::string PassLine(const std::string& name, const PassRow& row) {
  if (!row.fault.empty()) return fmt::format("{:<24}  {}\n", name, row.fault);
  return fmt::format("{:<24}{:>4} of {}{:>8.1f}{:>8.1f}{:>8.1f}{:>8.1f}{:>9.2f}{:>8.2f}{:>8.2f}\n",
                     name, row.clean, row.handovers, row.receiver.turned_rad / kDegree,
                     1e3 * row.receiver.moved_m, row.giver.turned_rad / kDegree,
                     1e3 * row.giver.moved_m, row.deepest_mm, row.carrying_acceleration,
                     row.free_acceleration);
}

nlohmann::json PassJson(const PassRow& row) {
  return {{"handovers", row.handovers},
          {"clean", row.clean},
          {"receiver_turned_deg", row.receiver.turned_rad / kDegree},
          {"receiver_moved_mm", 1e3 * row.receiver.moved_m},
          {"giver_turned_deg", row.giver.turned_rad / kDegree},
          {"giver_moved_mm", 1e3 * row.giver.moved_m},
          {"max_penetration_depth_mm", row.deepest_mm},
          {"carrying_acceleration_ratio", row.carrying_acceleration},
          {"free_acceleration_ratio", row.free_acceleration}};
}

int Run(const HandoversCommand& options) {
  const CommonOptions& common = options.common;
  if (!options.output.empty()) RequireNew(options.output, common);
  const LoadedClip motion = LoadClip(options.clip, nullptr, common);
  const Clip mirrored = MirroredClip(motion.clip, motion.body);
  CarryOptions carry;
  carry.keep_motion = options.keep_motion;
  carry.threads = NumThreads(common);
  carry.seed = common.seed;
  Progress progress(common, "handovers");
  std::vector<PassRow> rows;
  const int ways = options.one_way ? 1 : 2;
  const int total = ways * static_cast<int>(options.objects.size());
  std::string text = fmt::format(
      "{:<24}{:>9}{:>16}{:>16}{:>9}{:>16}\n{:<24}{:>9}{:>8}{:>8}{:>8}{:>8}{:>9}{:>8}{:>8}\n", "",
      "grasps", "receiver", "giver", "deepest", "acceleration", "object", "clean", "deg", "mm",
      "deg", "mm", "mm", "carries", "free");
  nlohmann::json json = JsonHead("holdfast/evaluate-handovers/1", common);
  for (const std::string& name : options.objects) {
    const PreparedObject object = PrepareObject(LoadObject(name), 300, carry.threads);
    for (int way = 0; way < ways; ++way) {
      std::optional<PassRow> row =
          TryPass(way == 0 ? motion.clip : mirrored, motion.body, object, carry,
                  [](const char*, int, int) { return !Interrupted(); });
      if (!row) return kInterrupted;
      row->mirrored = way == 1;
      text += PassLine(row->object + (row->mirrored ? ", mirrored" : ""), *row);
      nlohmann::json entry = PassJson(*row);
      entry.update({{"object", row->object}, {"mirrored", row->mirrored}, {"fault", row->fault}});
      json["passes"].push_back(std::move(entry));
      rows.push_back(std::move(*row));
      progress.Update(static_cast<int>(rows.size()), total);
    }
  }
  const PassRow all = SummarizePasses(rows);
  text += PassLine("mean (depth, ratios: most)", all);
  json["summary"] = PassJson(all);
  if (options.found > 0) {
    HandoverStudyOptions study;
    study.count = options.found;
    study.threads = carry.threads;
    const HandoverStudy found = RunHandoverStudy(LoadBody(""), study);
    text += fmt::format(
        "found within 2 frames: {} of {} from the object's noisy trajectory, {} from the body "
        "alone\n",
        found.found_with_object, options.found, found.found_without_object);
    json["summary"].update({{"synthetic", options.found},
                            {"found_with_object", found.found_with_object},
                            {"found_without_object", found.found_without_object}});
  }
  if (!options.output.empty()) WriteAtomically(options.output, JsonText(json, 1) + "\n");
  PrintResult(common, json, text);
  return kDone;
}

}  // namespace

void AddEvaluateHandovers(CLI::App& evaluate, int& exit_code) {
  auto options = std::make_shared<HandoversCommand>();
  CLI::App* command = evaluate.add_subcommand(
      "handovers",
      "Pass objects from hand to hand, and find hand-overs: how far do wrists leave the clip's?");
  command->add_option("objects", options->objects, "Meshes or embedded objects")
      ->capture_default_str();
  command->add_option("-o,--output", options->output, "Write the numbers as JSON");
  AddOption(*command, "--clip", options->clip, "The motion in which the object is passed");
  command->add_flag("--one-way", options->one_way, "The clip as it is, not its mirror image too");
  command->add_flag("--keep-motion", options->keep_motion,
                    "The giving arm stays where the clip has it");
  AddOption(*command, "--found", options->found, "Number of synthetic hand-overs to find",
            CLI::Range(0, 10'000));
  AddCommonOptions(*command, options->common, true,
                   "  holdfast evaluate handovers -o handovers.json\n"
                   "  holdfast evaluate handovers apple --one-way --found 4\n");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace holdfast::apps
