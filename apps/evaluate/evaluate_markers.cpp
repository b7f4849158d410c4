// SPDX-License-Identifier: MIT
#include "apps/evaluate/evaluate_markers.h"

#include <algorithm>
#include <cstdlib>
#include <map>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/parallel.h"
#include "solver/evaluation/marker_study.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

struct MarkersCommand {
  CommonOptions common;
  std::string folder, body, csv;
  int every = 1;
  MarkerStudyOptions study;
};

// Recordings of the folder and those below it, by name; "..._static..." is the static trial of the
// others beside it.
std::vector<MarkerTrial> Trials(const fs::path& folder, int every) {
  std::map<fs::path, std::shared_ptr<const MarkerRecording>> still;
  std::vector<fs::path> files;
  if (!fs::is_directory(folder)) {
    throw Error(folder.string(), "is no folder",
                "Give one with recordings and a ..._static... file for each person");
  }
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (!entry.is_regular_file() || name.find(".csv") == std::string::npos ||
        entry.path().parent_path() == folder) {
      continue;
    }
    if (name.find("_static") != std::string::npos) {
      still[entry.path().parent_path()] =
          std::make_shared<const MarkerRecording>(ReadMarkers(entry.path()));
    } else {
      files.push_back(entry.path());
    }
  }
  std::ranges::sort(files);
  std::vector<MarkerTrial> trials;
  for (std::size_t k = 0; k < files.size(); k += static_cast<std::size_t>(every)) {
    std::string name = files[k].filename().string();
    trials.push_back(
        {name.substr(0, name.find('.')), ReadMarkers(files[k]), still[files[k].parent_path()]});
  }
  if (trials.empty()) {
    throw Error(folder.string(), "holds no recordings in folders of people", "Check the path");
  }
  return trials;
}

// What all trials come to.
struct Sums {
  MarkerErrors residual, left_out, gap, change;
  const MarkerTrialResult *worst = nullptr, *worst_change = nullptr, *slowest = nullptr;
  std::map<std::string, MarkerErrors> of_left_out;
  double seconds = 0.0, core_s = 0.0;
  int faults = 0;
};

double Speed(const MarkerTrialResult& row) { return row.frames / row.core_s; }

Sums SumsOf(const std::vector<MarkerTrialResult>& rows) {
  Sums sums;
  for (const MarkerTrialResult& row : rows) {
    if (!row.fault.empty()) {
      ++sums.faults;
      continue;
    }
    sums.residual += row.residual;
    sums.gap += row.gap;
    sums.change += row.change;
    for (const auto& left : row.left_out) {
      sums.left_out += left.errors;
      sums.of_left_out[left.marker] += left.errors;
    }
    sums.seconds += row.frames / row.rate_hz;
    sums.core_s += row.core_s;
    if (!sums.worst || row.residual.Rms_mm() > sums.worst->residual.Rms_mm()) sums.worst = &row;
    if (!sums.worst_change || row.change.Rms_mm() > sums.worst_change->change.Rms_mm()) {
      sums.worst_change = &row;
    }
    if (!sums.slowest || Speed(row) < Speed(*sums.slowest)) sums.slowest = &row;
  }
  return sums;
}

std::string Table(const std::vector<MarkerTrialResult>& rows, const Sums& sums) {
  std::string text;
  for (const MarkerTrialResult& row : rows) {
    if (!row.fault.empty()) text += fmt::format("{}: {}\n", row.name, row.fault);
  }
  if (sums.worst == nullptr) return text + "no trial was solved\n";
  text += fmt::format("{} trials solved, {:.1f} minutes\n", rows.size() - sums.faults,
                      sums.seconds / 60.0);
  text += fmt::format(
      "marker residual               {:6.1f} mm   worst trial {} {:.1f} mm ({} {:.1f} mm)\n",
      sums.residual.Rms_mm(), sums.worst->name, sums.worst->residual.Rms_mm(),
      sums.worst->worst_marker, sums.worst->worst_rms_mm);
  if (!sums.of_left_out.empty()) {
    const auto worst = std::ranges::max_element(
        sums.of_left_out, {}, [](const auto& entry) { return entry.second.Rms_mm(); });
    text += fmt::format("a marker left out             {:6.1f} mm   worst marker {} {:.1f} mm\n",
                        sums.left_out.Rms_mm(), worst->first, worst->second.Rms_mm());
  }
  text += fmt::format("gaps                          {:6.1f} mm\n", sums.gap.Rms_mm());
  text += fmt::format(
      "outliers and a swapped pair   {:6.1f} mm   worst trial {} {:.1f} mm (up to {:.0f} mm)\n",
      sums.change.Rms_mm(), sums.worst_change->name, sums.worst_change->change.Rms_mm(),
      sums.worst_change->change_max_mm);
  text += fmt::format("frames a second on one core   {:6.0f}      slowest trial {} {:.0f}\n",
                      sums.seconds / sums.core_s * sums.slowest->rate_hz, sums.slowest->name,
                      Speed(*sums.slowest));
  return text;
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
          {"core_s", row.core_s}};
}

std::string Csv(const std::vector<MarkerTrialResult>& rows) {
  std::string text =
      "trial,frames,rms_mm,worst_marker,worst_marker_rms_mm,left_out,left_out_rms_mm,gap_rms_mm,"
      "faults_change_rms_mm,faults_change_max_mm,core_s\n";
  for (const MarkerTrialResult& row : rows) {
    MarkerErrors left;
    std::string names;
    for (const auto& out : row.left_out) {
      left += out.errors;
      names += (names.empty() ? "" : " ") + out.marker;
    }
    text += fmt::format("{},{},{:.3f},{},{:.3f},{},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f}\n", row.name,
                        row.frames, row.residual.Rms_mm(), row.worst_marker, row.worst_rms_mm,
                        names, left.Rms_mm(), row.gap.Rms_mm(), row.change.Rms_mm(),
                        row.change_max_mm, row.core_s);
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
  const std::vector<MarkerTrial> trials = Trials(options.folder, options.every);
  options.study.seed = common.seed;
  options.study.threads = NumThreads(common);
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
  const Sums sums = SumsOf(rows);
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
  PrintResult(common, json, Table(rows, sums));
  return sums.worst == nullptr ? kFitFault : kDone;
}

}  // namespace

void AddEvaluateMarkers(CLI::App& evaluate, int& exit_code) {
  auto options = std::make_shared<MarkersCommand>();
  CLI::App* command = evaluate.add_subcommand(
      "markers", "Solve recordings of markers whole, with markers left out, gaps and wrong labels");
  command->add_option("folder", options->folder,
                      "Folders of people, each with recordings (CSV) and a ..._static... one "
                      "[HOLDFAST_DATA/adl]");
  command->add_option("--body", options->body, "Body model in place of the embedded one");
  command->add_option("--csv", options->csv, "A row a trial, to this file");
  AddOption(*command, "--every", options->every, "Only every n-th trial", CLI::Range(1, 100'000));
  AddOption(*command, "--left-out", options->study.left_out,
            "Markers left out of each trial, one at a time; the next trial has the next ones",
            CLI::Range(0, 1'000));
  AddOption(*command, "--gap", options->study.gap_s, "Length of gaps, seconds; 0: none",
            CLI::Range(0.0, 10.0));
  AddOption(*command, "--outliers", options->study.outlier_share,
            "Share of positions that are moved by 50 to 200 mm, with a swapped pair; 0: none",
            CLI::Range(0.0, 0.5));
  AddCommonOptions(*command, options->common, true,
                   "  holdfast evaluate markers recordings --csv trials.csv\n"
                   "  holdfast evaluate markers recordings --every 12 --left-out 3\n");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace holdfast::apps
