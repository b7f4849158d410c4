// SPDX-License-Identifier: MIT
#include "apps/evaluate/evaluate_hold.h"

#include <algorithm>
#include <chrono>
#include <cstdlib>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/render/video.h"
#include "solver/carry/first_grasp.h"
#include "solver/carry/standing_grasp.h"
#include "solver/trial/trial_clip.h"
#include "solver/trial/trial_film.h"
#include "solver/trial/trial_grasps.h"

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

struct HoldRow {
  std::string object, fault;
  std::optional<ClipTrial> trial;
  double trial_s = 0.0;
};

// A grasp of the object as `grasp` makes it, tried. Nothing when interrupted.
std::optional<HoldRow> TryObject(const HoldCommand& options,
                                 const std::shared_ptr<const BodyModel>& body,
                                 const std::string& name) {
  const LoadedObject object = LoadObject(name);
  HoldRow row;
  row.object = object.name;
  GraspOptions grasp;
  grasp.seed = options.common.seed;
  grasp.threads = NumThreads(options.common);
  ClipScene scene;
  if (const auto why = WhyTooLarge(object, false)) {
    row.fault = *why;
    return row;
  }
  StandingGrasp held = GraspStanding(body, body->LoneHand().value_or(Side::kRight), object, grasp,
                                     [](double) { return !Interrupted(); });
  if (Interrupted()) return std::nullopt;
  if (held.report.status != GraspStatus::kFound) {
    row.fault = Describe(held.report.status);
    return row;
  }
  scene.source = object.name;
  scene.betas = held.clip.betas;
  scene.clip = std::move(held.clip);
  scene.body = body;
  scene.object = object.mesh;
  TrialProtocol protocol = options.protocol;
  protocol.threads = NumThreads(options.common);
  const auto begin = std::chrono::steady_clock::now();
  row.trial = TryClip(scene, protocol);
  row.trial_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (row.trial && !options.film.empty()) {
    WriteTrialFilm(options.film, scene, *row.trial, protocol.threads);
  }
  return row;
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

// Many grasps of each object, as `grasp --count` makes them.
int RunSets(const HoldCommand& options) {
  const CommonOptions& common = options.common;
  const std::shared_ptr<const BodyModel> body = LoadBody(options.body);
  const HandModel hand(body, {}, body->LoneHand().value_or(Side::kRight));
  TrialProtocol protocol = options.protocol;
  protocol.threads = NumThreads(common);
  nlohmann::json json = JsonHead("holdfast/evaluate-hold-sets/1", common);
  json["protocol"] = TrialProtocolJson(protocol);
  std::string csv = "object,grasp,held_directions,worst_slip_mm,worst_slip_deg\n";
  std::string text =
      fmt::format("{:<24}{:>8}{:>13}{:>8}\n", "object", "grasps", "hold in six", "share");
  int tried = 0, all = 0;
  Progress progress(common, "hold");
  for (const std::string& name : options.objects) {
    const LoadedObject object = LoadObject(name);
    GraspSetOptions set_options;
    set_options.count = options.count;
    set_options.search.seed = common.seed;
    set_options.search.threads = protocol.threads;
    DistanceGridOptions grid_options;
    grid_options.threads = protocol.threads;
    const DistanceGrid grid(SignedDistance(object.mesh), grid_options);
    const GraspSet set =
        FindGrasps(hand, object.mesh, grid, set_options, [](double) { return !Interrupted(); });
    const std::vector<HoldTrial> trials =
        TryGrasps(hand, object.mesh, set.grasps, protocol, [&](double share) {
          progress.Update(static_cast<int>(share * options.count), options.count);
          return !Interrupted();
        });
    if (Interrupted()) return kInterrupted;
    int held = 0;
    for (std::size_t i = 0; i < trials.size(); ++i) {
      held += trials[i].Held() == kTrialDirections;
      csv += fmt::format("{},{},{},{:.3f},{:.3f}\n", object.name, i, trials[i].Held(),
                         trials[i].WorstSlip_mm(), trials[i].WorstSlip_deg());
    }
    const auto count = static_cast<int>(trials.size());
    const double share = held / std::max(1.0, static_cast<double>(count));
    json["objects"].push_back(
        {{"object", object.name}, {"grasps", count}, {"hold_all_six", held}, {"share", share}});
    text += fmt::format("{:<24}{:>8}{:>13}{:>7.0f}%\n", object.name, count, held, 100.0 * share);
    tried += count;
    all += held;
  }
  json["summary"] = {{"grasps", tried},
                     {"hold_all_six", all},
                     {"share", all / std::max(1.0, static_cast<double>(tried))}};
  if (!options.output.empty()) WriteAtomically(options.output, json.dump(1) + "\n");
  if (!options.csv.empty()) WriteAtomically(options.csv, csv);
  PrintResult(common, json,
              text + fmt::format("{} of {} hold in all six directions\n", all, tried));
  return kDone;
}

int Run(HoldCommand options) {
  const CommonOptions& common = options.common;
  RequirePhysics();
  for (const std::string& path : {options.output, options.csv, options.film}) {
    if (!path.empty()) RequireNew(path, common);
  }
  if (options.objects.empty()) options.objects = UsualObjects();
  if (options.count > 0) return RunSets(options);
  if (!options.film.empty() && (options.objects.size() > 1 || !VideoFormatOf(options.film))) {
    throw Error("--film", "is a video (.mp4, .gif) of one object's trial", "Name one object");
  }
  const std::shared_ptr<const BodyModel> body = LoadBody(options.body);
  Progress progress(common, "hold");
  std::vector<HoldRow> rows;
  nlohmann::json json = JsonHead("holdfast/evaluate-hold/1", common);
  json["protocol"] = TrialProtocolJson(options.protocol);
  for (const std::string& name : options.objects) {
    const std::optional<HoldRow> row = TryObject(options, body, name);
    if (!row) return kInterrupted;
    nlohmann::json entry = {{"object", row->object}};
    entry["trial"] = row->trial ? TrialJson(*row->trial) : nlohmann::json(nullptr);
    if (!row->trial) entry["fault"] = row->fault;
    json["objects"].push_back(std::move(entry));
    rows.push_back(*row);
    progress.Update(static_cast<int>(rows.size()), static_cast<int>(options.objects.size()));
  }
  const auto all = std::ranges::count_if(
      rows, [](const HoldRow& row) { return row.trial && row.trial->hold.Held() == 6; });
  json["summary"] = {{"objects", rows.size()},
                     {"hold_all_six", all},
                     {"share", static_cast<double>(all) / static_cast<double>(rows.size())}};
  if (!options.output.empty()) WriteAtomically(options.output, json.dump(1) + "\n");
  if (!options.csv.empty()) WriteAtomically(options.csv, HoldCsv(rows));
  PrintResult(
      common, json,
      HoldTable(rows) + fmt::format("{} of {} hold in all six directions\n", all, rows.size()));
  return kDone;
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
