// SPDX-License-Identifier: MIT
#include "apps/evaluate/evaluate_hold.h"

#include <algorithm>
#include <cstdlib>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/json_file.h"
#include "geometry/render/video.h"
#include "solver/evaluation/hold_study.h"
#include "solver/trial/trial_clip.h"
#include "solver/trial/trial_film.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

struct HoldCommand {
  CommonOptions common;
  std::vector<std::string> objects;
  std::string body, output, csv, film;
  TrialProtocol protocol;
  int count = 0;  // grasps of each object; 0: the first of `grasp`
};

// The meshes of HOLDFAST_DATA/objects, where they are there, and what is part of the library.
std::vector<std::string> UsualObjects() {
  const char* const data = std::getenv("HOLDFAST_DATA");
  const fs::path folder = fs::path(data != nullptr ? data : "../shared/data") / "objects";
  std::vector<std::string> objects;
  if (fs::is_directory(folder)) {
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (entry.path().extension() == ".obj") objects.push_back(entry.path().string());
    }
  }
  std::ranges::sort(objects);
  for (const std::string& name : EmbeddedObjectNames()) objects.push_back(name);
  return objects;
}

std::string HoldTable(const std::vector<HoldRow>& rows) {
  std::string text = fmt::format("{:<24}{:>9}{:>10}{:>10}{:>12}{:>9}{:>8}\n", "object", "held of 6",
                                 "slip, mm", "slip, deg", "settled, mm", "mass, g", "s");
  for (const HoldRow& row : rows) {
    if (!row.trial) {
      text += fmt::format("{:<24}        -  {}\n", row.object, row.fault);
      continue;
    }
    const HoldTrial& hold = row.trial->hold;
    text += fmt::format("{:<24}{:>9}{:>10.1f}{:>10.1f}{:>12.1f}{:>9.0f}{:>8.1f}\n", row.object,
                        hold.Held(), hold.WorstSlip_mm(), hold.WorstSlip_deg(),
                        hold.settling.slip_mm, 1e3 * hold.mass_kg, row.trial_s);
  }
  return text;
}

std::string HoldCsv(const std::vector<HoldRow>& rows) {
  std::string text =
      "object,held_directions,worst_slip_mm,worst_slip_deg,settled_mm,settled_deg,mass_kg,grip_N\n";
  for (const HoldRow& row : rows) {
    text += row.object;
    if (row.trial) {
      const HoldTrial& hold = row.trial->hold;
      text += fmt::format(",{},{:.3f},{:.3f},{:.3f},{:.3f},{:.4f},{:.3f}\n", hold.Held(),
                          hold.WorstSlip_mm(), hold.WorstSlip_deg(), hold.settling.slip_mm,
                          hold.settling.slip_deg, hold.mass_kg, hold.grip_N);
    } else {
      text += ",,,,,,,\n";
    }
  }
  return text;
}

// Both studies: a row an object, told as it is done; nothing when interrupted.
template <typename Row, typename Try>
std::optional<std::vector<Row>> RowsOf(const HoldCommand& options, const Try& attempt) {
  Progress progress(options.common, "hold");
  std::vector<Row> rows;
  const auto objects = static_cast<double>(options.objects.size());
  for (const std::string& name : options.objects) {
    std::optional<Row> row = attempt(LoadObject(name), [&](double share) {
      progress.Update(static_cast<int>(100.0 * (static_cast<double>(rows.size()) + share)),
                      static_cast<int>(100.0 * objects));
      return !Interrupted();
    });
    if (!row || Interrupted()) return std::nullopt;
    rows.push_back(std::move(*row));
  }
  return rows;
}

int Write(const HoldCommand& options, const nlohmann::json& json, const std::string& csv,
          const std::string& text) {
  if (!options.output.empty()) WriteAtomically(options.output, JsonText(json, 1) + "\n");
  if (!options.csv.empty()) WriteAtomically(options.csv, csv);
  const nlohmann::json& summary = json.at("summary");
  PrintResult(
      options.common, json,
      text + fmt::format("{} of {} hold in all six directions\n",
                         summary.at("hold_all_six").get<int>(),
                         summary.at(summary.contains("grasps") ? "grasps" : "objects").get<int>()));
  return kDone;
}

nlohmann::json Summary(const char* what, std::ptrdiff_t held, std::size_t tried) {
  return {{what, tried},
          {"hold_all_six", held},
          {"share", static_cast<double>(held) / std::max(1.0, static_cast<double>(tried))}};
}

// Many grasps of each object, as `grasp --count` makes them.
int RunSets(const HoldCommand& options, const HoldStudyOptions& study) {
  const std::shared_ptr<const BodyModel> body = LoadBody(options.body);
  const HandModel hand(body, {}, body->LoneHand().value_or(Side::kRight));
  const auto rows = RowsOf<HoldSetRow>(options, [&](const LoadedObject& object, const auto& told) {
    return TryManyGrasps(hand, object, options.count, study, told);
  });
  if (!rows) return kInterrupted;
  nlohmann::json json = JsonHead("holdfast/evaluate-hold-sets/1", options.common);
  json["protocol"] = TrialProtocolJson(study.protocol);
  std::string csv = "object,grasp,held_directions,worst_slip_mm,worst_slip_deg\n";
  std::string text =
      fmt::format("{:<24}{:>8}{:>13}{:>8}\n", "object", "grasps", "hold in six", "share");
  std::ptrdiff_t held = 0;
  std::size_t tried = 0;
  for (const HoldSetRow& row : *rows) {
    for (std::size_t i = 0; i < row.trials.size(); ++i) {
      csv += fmt::format("{},{},{},{:.3f},{:.3f}\n", row.object, i, row.trials[i].Held(),
                         row.trials[i].WorstSlip_mm(), row.trials[i].WorstSlip_deg());
    }
    nlohmann::json entry = Summary("grasps", row.NumHeld(), row.trials.size());
    entry["object"] = row.object;
    text += fmt::format("{:<24}{:>8}{:>13}{:>7.0f}%\n", row.object, row.trials.size(),
                        row.NumHeld(), 100.0 * entry["share"].get<double>());
    json["objects"].push_back(std::move(entry));
    held += row.NumHeld();
    tried += row.trials.size();
  }
  json["summary"] = Summary("grasps", held, tried);
  return Write(options, json, csv, text);
}

int Run(HoldCommand options) {
  const CommonOptions& common = options.common;
  RequirePhysics();
  for (const std::string& path : {options.output, options.csv, options.film}) {
    if (!path.empty()) RequireNew(path, common);
  }
  if (options.objects.empty()) options.objects = UsualObjects();
  HoldStudyOptions study{options.protocol, common.seed};
  study.protocol.threads = NumThreads(common);
  if (options.count > 0) return RunSets(options, study);
  if (!options.film.empty() && (options.objects.size() > 1 || !VideoFormatOf(options.film))) {
    throw Error("--film", "is a video (.mp4, .gif) of one object's trial", "Name one object");
  }
  const std::shared_ptr<const BodyModel> body = LoadBody(options.body);
  const auto rows = RowsOf<HoldRow>(options, [&](const LoadedObject& object, const auto& told) {
    return TryFirstGrasp(body, object, study, told);
  });
  if (!rows) return kInterrupted;
  nlohmann::json json = JsonHead("holdfast/evaluate-hold/1", common);
  json["protocol"] = TrialProtocolJson(options.protocol);
  for (const HoldRow& row : *rows) {
    nlohmann::json entry = {{"object", row.object}};
    entry["trial"] = row.trial ? TrialJson(*row.trial) : nlohmann::json(nullptr);
    if (!row.trial) entry["fault"] = row.fault;
    json["objects"].push_back(std::move(entry));
  }
  const auto held = std::ranges::count_if(*rows, [](const HoldRow& row) {
    return row.trial && row.trial->hold.Held() == kTrialDirections;
  });
  json["summary"] = Summary("objects", held, rows->size());
  const HoldRow& first = rows->front();
  if (first.trial && !options.film.empty()) {
    WriteTrialFilm(options.film, first.scene, *first.trial, study.protocol.threads);
  }
  return Write(options, json, HoldCsv(*rows), HoldTable(*rows));
}

}  // namespace

void AddEvaluateHold(CLI::App& evaluate, int& exit_code) {
  auto options = std::make_shared<HoldCommand>();
  CLI::App* command = evaluate.add_subcommand(
      "hold", "Simulate grasps (MuJoCo): does the hand keep the object, whichever way is down?");
  command->add_option("objects", options->objects,
                      "Meshes or embedded objects; default: those of HOLDFAST_DATA and all "
                      "embedded ones");
  command->add_option("-o,--output", options->output, "Write the trials as JSON");
  command->add_option("--csv", options->csv,
                      "Write a table with one line per object, with --count per grasp");
  CLI::Option* const film = command->add_option("--film", options->film,
                                                "Write a film (.mp4, .gif) of one object's trial");
  command
      ->add_option("--count", options->count,
                   "Try so many distinct grasps of each object (`grasp --count`), not the first")
      ->check(CLI::Range(1, 1'000'000))
      ->excludes(film);
  command->add_option("--body", options->body, "Body model; default: the embedded one");
  AddOption(*command, "--friction", options->protocol.scene.friction,
            "Coefficient of friction of hand and object", CLI::NonNegativeNumber);
  AddCommonOptions(*command, options->common, true,
                   "  holdfast evaluate hold sphere\n"
                   "  holdfast evaluate hold mug --film trial.gif -o trial.json\n"
                   "  holdfast evaluate hold mug --count 10\n");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace holdfast::apps
