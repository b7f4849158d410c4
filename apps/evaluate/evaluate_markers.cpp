// SPDX-License-Identifier: MIT
#include "apps/evaluate/evaluate_markers.h"

#include <algorithm>
#include <cstdlib>
#include <map>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/mesh/load_object.h"
#include "geometry/parallel.h"
#include "geometry/rotation.h"
#include "geometry/score/contact_score.h"
#include "solver/carry/carry_json.h"
#include "solver/evaluation/marker_study.h"
#include "solver/markers/marker_json.h"
#include "solver/markers/marker_world.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

struct MarkersCommand {
  CommonOptions common;
  std::string folder, body, csv, object, object_markers, cup;
  int every = 1;
  MarkerStudyOptions study;
};

// Every n-th trial of a folder, a person's static trial read once.
std::vector<MarkerTrial> ReadTrials(const fs::path& folder, int every) {
  const std::vector<MarkerTrialFiles> files = FindMarkerTrials(folder);
  std::map<fs::path, std::shared_ptr<const MarkerRecording>> still;
  std::vector<MarkerTrial> trials;
  for (std::size_t k = 0; k < files.size(); k += static_cast<std::size_t>(every)) {
    std::shared_ptr<const MarkerRecording>& at_rest = still[files[k].still];
    if (!at_rest && !files[k].still.empty()) {
      at_rest = std::make_shared<const MarkerRecording>(ReadMarkers(files[k].still));
    }
    trials.push_back({files[k].name, ReadMarkers(files[k].recording), at_rest});
  }
  return trials;
}

std::string TouchText(const MarkerTrialResult& row) {
  const TouchStudy& touch = *row.touches;
  return fmt::format(
      "{}: {} touches by markers, {} found ({} more), {} kept by refine\n"
      "deeper than {:g} mm: {} of {} frames solved (deepest {:.1f} mm), {} refined ({:.1f} mm)\n",
      row.name, touch.touches.size(), touch.found, touch.more, touch.kept, kDeep_mm,
      touch.deep_solved, touch.frames, touch.deepest_solved_mm, touch.deep_refined,
      touch.deepest_refined_mm);
}

std::string Table(const std::vector<MarkerTrialResult>& rows, const MarkerStudySums& sums) {
  std::string text;
  for (const MarkerTrialResult& row : rows) {
    if (!row.fault.empty()) text += fmt::format("{}: {}\n", row.name, row.fault);
    if (row.touches) text += TouchText(row);
  }
  if (sums.solved == 0) return text + "no trial was solved\n";
  const MarkerTrialResult &worst = rows[*sums.worst], &change = rows[*sums.worst_change],
                          &slowest = rows[*sums.slowest];
  text += fmt::format("{} trials solved, {:.1f} minutes\n", sums.solved, sums.seconds / 60.0);
  text += fmt::format(
      "marker residual               {:6.1f} mm   worst trial {} {:.1f} mm ({} {:.1f} mm)\n",
      sums.residual.Rms_mm(), worst.name, worst.residual.Rms_mm(), worst.worst_marker,
      worst.worst_rms_mm);
  if (!sums.of_left_out.empty()) {
    const auto marker = std::ranges::max_element(
        sums.of_left_out, {}, [](const auto& entry) { return entry.second.Rms_mm(); });
    text += fmt::format("a marker left out             {:6.1f} mm   worst marker {} {:.1f} mm\n",
                        sums.left_out.Rms_mm(), marker->first, marker->second.Rms_mm());
  }
  if (sums.gap.count > 0) {
    text += fmt::format("gaps                          {:6.1f} mm\n", sums.gap.Rms_mm());
  }
  if (sums.change.count > 0) {
    text += fmt::format(
        "outliers and a swapped pair   {:6.1f} mm   worst trial {} {:.1f} mm (up to {:.0f} mm)\n",
        sums.change.Rms_mm(), change.name, change.change.Rms_mm(), change.change_max_mm);
  }
  text += fmt::format("frames a second on one core   {:6.0f}      slowest trial {} {:.0f}\n",
                      sums.seconds / sums.core_s * slowest.rate_hz, slowest.name, slowest.Speed());
  return text;
}

nlohmann::json TouchesJson(const std::optional<TouchStudy>& study) {
  if (!study) return nullptr;
  return {{"by_markers", study->touches},
          {"found", study->found},
          {"kept", study->kept},
          {"without_marker", study->more},
          {"frames_deeper_than_2_mm", study->deep_solved},
          {"frames_deeper_than_2_mm_refined", study->deep_refined},
          {"max_penetration_depth_mm", study->deepest_solved_mm},
          {"max_penetration_depth_refined_mm", study->deepest_refined_mm}};
}

std::string HeadText(const HeadSums& head) {
  return fmt::format(
      "hand in an unmarked head      {:6} of {} frames deeper than 2 mm, up to {:.0f} mm; before "
      "it gives way {}, up to {:.0f} mm\n",
      head.deep, head.frames, head.worst_mm, head.deep_before, head.worst_before_mm);
}

std::string DrinkText(const std::vector<MarkerTrialResult>& rows, const DrinkSums& drinks) {
  return fmt::format(
      "rim from the mouth            {:6.1f} mm   {} of {} trials within 20 mm, worst {} {:.1f} "
      "mm\n"
      "  a cup that stands leans by up to {:.1f} deg, wrists leave the solve's by up to {:.0f} mm\n"
      "  skin in the cup up to {:.1f} mm (mean of a trial's frames), {} grasps not clean, {} "
      "frames deeper than 2 mm in the body\n",
      drinks.mean_mm, drinks.at_mouth, drinks.trials, rows[drinks.worst].name, drinks.worst_mm,
      drinks.lean_deg, drinks.wrist_mm, drinks.in_hand_mm, drinks.no_clean_grasp,
      drinks.in_body_frames);
}

nlohmann::json RowJson(const MarkerTrialResult& row) {
  nlohmann::json left = nlohmann::json::object();
  for (const auto& out : row.left_out) left[out.marker] = out.errors.Rms_mm();
  return {{"trial", row.name},
          {"fault", row.fault},
          {"frames", row.frames},
          {"rms_mm", row.residual.Rms_mm()},
          {"worst_marker", row.worst_marker},
          {"worst_marker_rms_mm", row.worst_rms_mm},
          {"left_out_rms_mm", left},
          {"gap_rms_mm", row.gap.Rms_mm()},
          {"faults_change_rms_mm", row.change.Rms_mm()},
          {"faults_change_max_mm", row.change_max_mm},
          {"core_s", row.core_s},
          {"head", HeadReportJson(row.head)},
          {"drink", DrinkJson(row.drink, row.drunk)},
          {"touches", TouchesJson(row.touches)}};
}

std::string DrinkCells(const MarkerTrialResult& row) {
  if (!row.drink) return ",,,,,,,";
  return fmt::format("{:.2f},{:.1f},{:.2f},{:.1f},{:.1f},{:.1f},{:.2f},{}",
                     1e3 * row.drunk.rim_from_mouth_m, row.drunk.tilt_rad / kDegree,
                     row.drunk.lean_rad / kDegree, 1e3 * row.drink->wrist_shift_m,
                     row.drink->wrist_turn_rad / kDegree, row.drink->head.turned_rad / kDegree,
                     row.in_hand_mm, row.in_body_frames);
}

std::string Csv(const std::vector<MarkerTrialResult>& rows) {
  std::string text =
      "trial,frames,rms_mm,worst_marker,worst_marker_rms_mm,left_out,left_out_rms_mm,gap_rms_mm,"
      "faults_change_rms_mm,faults_change_max_mm,hand_in_head_frames_before,hand_in_head_frames,"
      "rim_from_mouth_mm,tilt_deg,lean_on_table_deg,wrist_shift_max_mm,wrist_turn_max_deg,"
      "head_turn_max_deg,skin_in_cup_mm,in_body_frames\n";
  for (const MarkerTrialResult& row : rows) {
    MarkerErrors left;
    std::string names;
    for (const auto& out : row.left_out) {
      left += out.errors;
      names += (names.empty() ? "" : " ") + out.marker;
    }
    text +=
        fmt::format("{},{},{:.3f},{},{:.3f},{},{:.3f},{:.3f},{:.3f},{:.3f},{},{},{}\n", row.name,
                    row.frames, row.residual.Rms_mm(), row.worst_marker, row.worst_rms_mm, names,
                    left.Rms_mm(), row.gap.Rms_mm(), row.change.Rms_mm(), row.change_max_mm,
                    row.head.deep_before, row.head.deep, DrinkCells(row));
  }
  return text;
}

int Run(MarkersCommand options) {
  const CommonOptions& common = options.common;
  if (!options.csv.empty()) RequireNew(options.csv, common);
  if (options.folder.empty()) {
    const char* const data = std::getenv("HOLDFAST_DATA");
    options.folder = (fs::path(data != nullptr ? data : "../shared/data") / "adl").string();
  }
  const std::vector<MarkerTrial> trials = ReadTrials(options.folder, options.every);
  if (!options.object.empty()) {
    options.study.solve.object = ReadObjectMarkers(options.object_markers);
    options.study.object =
        std::make_shared<const PreparedObject>(PrepareObject(LoadObject(options.object)));
  }
  options.study.seed = common.seed;
  options.study.threads = NumThreads(common);
  if (!options.cup.empty()) {
    options.study.cup = std::make_shared<const PreparedObject>(
        PrepareObject(LoadObject(options.cup), 300, options.study.threads));
  }
  Progress progress(common, "markers");
  std::vector<MarkerTrialResult> rows;
  try {
    rows = StudyMarkers(trials, LoadBody(options.body), options.study, [&](int done, int total) {
      progress.Update(done, total);
      return !Interrupted();
    });
  } catch (const WorkStopped&) {
    return kInterrupted;
  }
  const MarkerStudySums sums = SumsOf(rows);
  const DrinkSums drinks = DrinksOf(rows);
  nlohmann::json json = JsonHead("holdfast/evaluate-markers/1", common);
  json["protocol"] = {{"left_out_per_trial", options.study.left_out},
                      {"gap_s", options.study.gap_s},
                      {"outlier_share", options.study.outlier_share},
                      {"swap_s", options.study.swap_s}};
  json["rms_mm"] = sums.residual.Rms_mm();
  json["left_out_rms_mm"] = sums.left_out.Rms_mm();
  json["gap_rms_mm"] = sums.gap.Rms_mm();
  json["faults_change_rms_mm"] = sums.change.Rms_mm();
  json["trials"] = nlohmann::json::array();
  for (const MarkerTrialResult& row : rows) json["trials"].push_back(RowJson(row));
  if (!options.csv.empty()) WriteAtomically(options.csv, Csv(rows));
  std::string text = Table(rows, sums) + HeadText(HeadsOf(rows));
  if (drinks.trials > 0) text += DrinkText(rows, drinks);
  PrintResult(common, json, text);
  return sums.solved == 0 ? kFitFault : kDone;
}

}  // namespace

void AddEvaluateMarkers(CLI::App& evaluate, int& exit_code) {
  auto options = std::make_shared<MarkersCommand>();
  CLI::App* command = evaluate.add_subcommand(
      "markers", "Solve recordings of markers whole, with markers left out, gaps and wrong labels");
  command->add_option("folder", options->folder,
                      "Recordings, or folders of people, each with recordings and a ..._static... "
                      "one [HOLDFAST_DATA/adl]");
  command->add_option("--body", options->body, "Body model in place of the embedded one");
  CLI::Option* const object =
      command->add_option("--object", options->object, "Mesh of an object in all of them: touches");
  CLI::Option* const markers =
      command->add_option("--object-markers", options->object_markers,
                          "Table of the object's markers: name,x,y,z in the mesh's frame, meters");
  object->needs(markers);
  markers->needs(object);
  command->add_option("--csv", options->csv, "A row a trial, to this file");
  AddOption(*command, "--every", options->every, "Only every n-th trial", CLI::Range(1, 100'000));
  AddOption(*command, "--left-out", options->study.left_out,
            "Markers left out of each trial, one at a time; the next trial has the next ones",
            CLI::Range(0, 1'000));
  command->add_option("--cup", options->cup,
                      "A cup (mesh or embedded object) for the hands of those who drink: how near "
                      "its rim comes to the mouth");
  AddOption(*command, "--gap", options->study.gap_s, "Length of gaps, seconds; 0: none",
            CLI::Range(0.0, 10.0));
  AddOption(*command, "--outliers", options->study.outlier_share,
            "Share of positions that are moved by 50 to 200 mm, with a swapped pair; 0: none",
            CLI::Range(0.0, 0.5));
  AddCommonOptions(
      *command, options->common, true,
      "  holdfast evaluate markers recordings --csv trials.csv\n"
      "  holdfast evaluate markers recordings --cup mug --left-out 0 --gap 0 --outliers 0\n"
      "  holdfast evaluate markers recordings --every 12 --left-out 3\n");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace holdfast::apps
