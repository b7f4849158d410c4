// SPDX-License-Identifier: MIT
#include "apps/evaluate/evaluate_transfer.h"

#include <cmath>
#include <map>

#include <fmt/format.h>

#include "apps/clip_input.h"
#include "geometry/io/container/json_file.h"
#include "solver/evaluation/robot_study.h"
#include "solver/robot_hand/robot_hand.h"
#include "solver/trial/trial_clip.h"

namespace holdfast::apps {
namespace {

struct TransferStudyCommand {
  CommonOptions common;
  ClipInputOptions input;
  std::vector<std::string> clips, robots;
  std::string output;
  bool no_baselines = false, no_physics = false;
};

// Means over the clips of one robot and method.
struct TransferMeans {
  int clips = 0, frames = 0, deep = 0, contacts = 0, bones = 0, held = 0, tried = 0;
  double contact = 0.0, angle = 0.0, press = 0.0, bone = 0.0, deepest = 0.0, ms = 0.0;

  void Add(const RobotStudyRow& row) {
    ++clips;
    frames += static_cast<int>(row.measures.frames.size());
    deep += row.measures.frames_deeper_than_2_mm;
    contact += row.measures.contact_mm * row.measures.contacts;
    angle += row.measures.angle_deg * row.measures.contacts;
    press += row.measures.press_deg * row.measures.contacts;
    if (row.measures.bones > 0) bone += row.measures.bone_deg * row.measures.bones;
    contacts += row.measures.contacts;
    bones += row.measures.bones;
    deepest += row.measures.deepest_mm;
    ms += row.ms_per_frame * static_cast<double>(row.measures.frames.size());
    tried += row.held.has_value();
    held += row.held == kTrialDirections;
  }
  nlohmann::json Json() const {
    return {{"clips", clips},
            {"frames", frames},
            {"contact_distance_mm", contact / std::max(contacts, 1)},
            {"contact_normal_deg", angle / std::max(contacts, 1)},
            {"press_direction_deg", press / contacts},
            {"bone_direction_deg", bone / bones},
            {"max_penetration_depth_mm", deepest / std::max(clips, 1)},
            {"frames_deeper_than_2_mm_ratio", static_cast<double>(deep) / std::max(frames, 1)},
            {"ms_per_frame", ms / std::max(frames, 1)},
            {"held_in_all_six", held},
            {"tried", tried}};
  }
};

std::string Degrees(const nlohmann::json& value) {
  const double degrees = value.get<double>();
  return std::isnan(degrees) ? "-" : fmt::format("{:.1f}°", degrees);
}

std::string TransferTable(const std::map<std::pair<std::string, std::string>, TransferMeans>& all) {
  std::string text = fmt::format("{:<16}{:<34}{:>11}{:>9}{:>9}{:>9}{:>9}{:>9}{:>10}{:>7}\n",
                                 "robot", "method", "contact, mm", "normals", "presses", "bones",
                                 "deepest", "> 2 mm", "ms/frame", "held");
  for (const auto& [key, means] : all) {
    const nlohmann::json json = means.Json();
    text += fmt::format("{:<16}{:<34}{:>11.2f}{:>9}{:>9}{:>9}{:>9.2f}{:>8.2f}%{:>10.2f}{:>4}/{}\n",
                        key.first, key.second, json["contact_distance_mm"].get<double>(),
                        Degrees(json["contact_normal_deg"]), Degrees(json["press_direction_deg"]),
                        Degrees(json["bone_direction_deg"]),
                        json["max_penetration_depth_mm"].get<double>(),
                        100.0 * json["frames_deeper_than_2_mm_ratio"].get<double>(),
                        json["ms_per_frame"].get<double>(), means.held, means.tried);
  }
  return text;
}

int RunTransferStudy(const TransferStudyCommand& options) {
  if (!options.output.empty()) RequireNew(options.output, options.common);
  RobotStudyOptions study;
  study.transfer.threads = study.protocol.threads = NumThreads(options.common);
  study.baselines = !options.no_baselines;
  study.physics = !options.no_physics;
  std::vector<RobotHand> robots;
  for (const std::string& path : options.robots) robots.push_back(ReadRobotHand(path));
  // All of them first: a name that is wrong ends in a second, not after minutes.
  std::vector<ClipInput> scenes;
  for (const std::string& clip : options.clips) {
    scenes.push_back(LoadClipInput(clip, options.input, options.common));
  }
  nlohmann::json json = JsonHead("holdfast/evaluate-transfer/1", options.common);
  json["protocol"] = RobotProtocolJson(study.transfer);
  json["protocol"]["trial"] = TrialProtocolJson(study.protocol);
  std::map<std::pair<std::string, std::string>, TransferMeans> means;
  Progress progress(options.common, "transfer");
  int done = 0;
  for (std::size_t k = 0; k < scenes.size(); ++k) {
    for (const RobotHand& robot : robots) {
      if (Interrupted()) return kInterrupted;
      for (const RobotStudyRow& row : StudyTransfer(scenes[k], robot, study)) {
        means[{robot.name, row.method}].Add(row);
        nlohmann::json entry = {
            {"robot", robot.name}, {"clip", options.clips[k]}, {"method", row.method}};
        entry.update(RobotMeasuresJson(row.measures));
        entry["ms_per_frame"] = row.ms_per_frame;
        entry["held_directions"] = row.held ? nlohmann::json(*row.held) : nlohmann::json();
        json["rows"].push_back(std::move(entry));
      }
      progress.Update(++done, static_cast<int>(options.clips.size() * robots.size()));
    }
  }
  for (const auto& [key, mean] : means) {
    nlohmann::json entry = mean.Json();
    entry["robot"] = key.first;
    entry["method"] = key.second;
    json["summary"].push_back(std::move(entry));
  }
  if (!options.output.empty()) {
    WriteWithoutWallTimes(json, options.output,
                          std::filesystem::path(options.output).replace_extension(".timing.json"));
  }
  PrintResult(options.common, json, TransferTable(means));
  return kDone;
}

}  // namespace

void AddEvaluateTransfer(CLI::App& evaluate, int& exit_code) {
  auto options = std::make_shared<TransferStudyCommand>();
  CLI::App* command = evaluate.add_subcommand(
      "transfer",
      "Clips on robots' hands: contacts kept, penetration, time; beside published ways");
  command->add_option("clips", options->clips, kClipHelp)->required();
  command->add_option("--robot", options->robots, "Robot hands (URDF, MJCF), one or more")
      ->required();
  command->add_option("-o,--output", options->output, "Write all rows as JSON");
  command->add_flag("--no-baselines", options->no_baselines, "Our method alone");
  command->add_flag("--no-physics", options->no_physics, "No trials in MuJoCo");
  AddClipInputOptions(*command, options->input);
  AddCommonOptions(*command, options->common, true,
                   "  holdfast evaluate transfer held --robot hand.urdf\n"
                   "  holdfast evaluate transfer held --robot hand.urdf --no-baselines -o "
                   "transfer.json --threads 1\n");
  command->callback([options, &exit_code] { exit_code = RunTransferStudy(*options); });
}

}  // namespace holdfast::apps
