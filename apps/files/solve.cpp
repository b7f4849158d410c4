// SPDX-License-Identifier: MIT
#include <chrono>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/common.h"
#include "apps/output.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/error.h"
#include "geometry/import/file_kind.h"
#include "geometry/io/markers/c3d.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/object/load_object.h"
#include "geometry/rotation.h"
#include "solver/markers/marker_json.h"

namespace holdfast::apps {
namespace {

struct SolveCommand {
  CommonOptions common;
  std::string recording, still, table, body, output;
  std::string object, object_markers;
  SolveMarkersOptions solve;
  KeypointOptions keypoints;
  double object_scale = 1.0;
};

nlohmann::json MetricsOf(SolveCommand& options, const SolvedRecording& solved, double solve_ms) {
  nlohmann::json metrics = JsonHead("holdfast/solve/1", options.common);
  metrics["options"] = {{"recording", options.recording},
                        {"static", options.still},
                        {"markers", options.table},
                        {"body", options.body},
                        {"object", options.object},
                        {"object_scale", options.object_scale},
                        {"object_markers", options.object_markers}};
  metrics["options"].update(OptionsJson(OptionsOf(options.solve)));
  metrics["frames"] = solved.clip.NumFrames();
  metrics["frame_rate_hz"] = solved.clip.frame_rate;
  metrics.update(MarkerReportJson(solved.report));
  metrics["solve"] = {{"iterations", solved.report.iterations},
                      {"converged", solved.report.converged}};
  metrics["solve"]["solve_ms"] = solve_ms;
  metrics["solve"]["frames_per_s"] = 1e3 * solved.clip.NumFrames() / solve_ms;
  return metrics;
}

std::string ObjectText(const ObjectMarkerReport& object) {
  int filled = 0;
  for (const auto& [begin, end] : object.gaps) filled += end - begin;
  std::string text = fmt::format(
      "  object: {} markers, residual {:.1f} mm; frames filled: {} in {} gaps; outliers removed: "
      "{}; swapped labels corrected: {} frames\n",
      object.markers.size(), object.rms_mm, filled, object.gaps.size(),
      object.faults.outliers.size(), object.faults.swaps.size());
  if (object.table_rms_mm) {
    text += fmt::format("  object's markers are {:.1f} mm from their given positions\n",
                        *object.table_rms_mm);
  }
  return text;
}

// Loads the object's markers if given, and its mesh if there is one.
std::optional<LoadedObject> TakeObject(const SolveCommand& options,
                                       const MarkerRecording& recording,
                                       SolveMarkersOptions& solve) {
  if (options.object_markers.empty()) {
    if (options.object.empty()) return std::nullopt;
    throw Error("--object", "has no marker positions",
                "Give a table of the markers' positions with --object-markers (name,x,y,z)");
  }
  solve.object = ObjectMarkersOf(options.object_markers, recording, options.recording);
  if (options.object.empty()) return std::nullopt;
  if (solve.object->places.cols() == 0) {
    throw Error("--object-markers", "has names without positions on the mesh",
                "Give a table of positions in the mesh frame (name,x,y,z), or leave out --object");
  }
  return LoadObject(options.object, options.object_scale);
}

std::string Text(const SolveCommand& options, const SolvedRecording& solved, double solve_ms) {
  const MarkerReport& report = solved.report;
  const int frames = solved.clip.NumFrames();
  int used = 0, gaps = 0;
  for (const SolvedMarker& marker : report.markers) {
    used += marker.seen > 0;
    gaps += marker.seen > 0 ? frames - marker.seen : 0;
  }
  std::string text = fmt::format(
      "{}: {} frames at {:g} Hz from {} markers\n"
      "  marker residual {:.1f} mm (root mean square); largest: {} {:.1f} mm\n"
      "  gaps filled: {} positions; outliers removed: {}; swapped labels corrected: {} frames\n"
      "  {} up, facing {:.0f} degrees; raised by {:.3f} m to the ground\n",
      options.output, frames, solved.clip.frame_rate, used, report.rms_mm, report.worst_marker,
      report.worst_rms_mm, gaps, report.faults.outliers.size(), report.faults.swaps.size(),
      UpAxisName(report.world.up), report.world.facing_rad / kDegree, report.lift_m);
  if (report.world.scale != 1.0) {
    text += fmt::format("  wrong unit: positions scaled by {:g}\n", report.world.scale);
  }
  if (!report.unmarked.empty()) {
    text += "  joints without markers, at rest:";
    for (const int joint : report.unmarked)
      text += fmt::format(" {}", kJointNames[static_cast<std::size_t>(joint)]);
    text += '\n';
  }
  if (!report.never_seen.empty()) {
    text += fmt::format("  known markers without data: {}\n", fmt::join(report.never_seen, " "));
  }
  if (!report.unused.empty()) {
    text += "  markers with unknown names, ignored:";
    for (const UnusedMarker& marker : report.unused) {
      text += ' ' + marker.name;
      if (!marker.nearest.empty()) text += fmt::format(" ({}?)", marker.nearest);
    }
    text += '\n';
  }
  if (report.object) text += ObjectText(*report.object);
  return text + fmt::format("  solved in {:.1f} s: {:.0f} frames a second\n", 1e-3 * solve_ms,
                            1e3 * frames / solve_ms);
}

// Warns about parts of the result that should be checked.
void WarnOfDoubts(const SolveCommand& options, const MarkerReport& report) {
  if (!report.unused.empty()) {
    std::vector<std::string> names;
    for (const UnusedMarker& marker : report.unused) names.push_back(marker.name);
    Note(options.common,
         fmt::format("warning: {}: {} of {} markers are ignored because their names are unknown: "
                     "{}. Add them with --markers (name,joint,vertex,cluster)",
                     options.recording, names.size(), names.size() + report.markers.size(),
                     fmt::join(names, " ")));
  }
  if (report.rms_mm > kDoubtfulRms_mm) {
    Note(options.common,
         fmt::format(
             "warning: {}: the marker residual is {:.0f} mm (root mean square; largest: {} {:.0f} "
             "mm), more than {:g} mm. Markers are not where their names say, labels are wrong, or "
             "several people are in the recording; inspect it with 'holdfast render --markers'",
             options.recording, report.rms_mm, report.worst_marker, report.worst_rms_mm,
             kDoubtfulRms_mm));
  }
}

constexpr double kMaxShareOfOther = 0.8;  // of the residual of the next best reading

// Whether a file holds arrays, which may be keypoints; markers are in other formats.
bool HoldsArrays(const std::string& path) {
  switch (Identify(path).kind) {
    case FileKind::kNpy:
    case FileKind::kNpz:
    case FileKind::kPickle:
    case FileKind::kTorch:
    case FileKind::kJson:
      return true;
    default:
      return false;
  }
}

int SolveHand(const SolveCommand& options) {
  for (const auto& [flag, value] : {std::pair("--static", &options.still),
                                    {"--markers", &options.table},
                                    {"--object", &options.object},
                                    {"--object-markers", &options.object_markers},
                                    {"--body", &options.body}}) {
    if (value->empty()) continue;
    throw Error(flag, "is for markers: keypoints of a hand need no such file",
                "Leave it out; give an object to 'holdfast refine'");
  }
  ResultFolder folder(options.output, options.common.force);
  KeypointOptions keypoints = options.keypoints;
  keypoints.up = options.solve.up;
  const std::vector<KeypointTable> tables = ReadHandKeypoints(options.recording);
  const auto done = RunStaged(options.common, [&](const StagedProgress& progress) {
    return SolveKeypoints(tables, keypoints, options.recording, progress);
  });
  if (!done) return kInterrupted;
  const SolvedKeypoints& solved = *done;
  const KeypointReport& report = solved.report;
  for (const std::string& note : report.notes) Note(options.common, "note: " + note);
  const int frames = solved.clip.NumFrames();
  if (report.gaps > 0) {
    Note(options.common, fmt::format("warning: {}: no hand in {} of {} frames: filled between "
                                     "their neighbors",
                                     options.recording, report.gaps, frames));
  }
  if (report.other_rms_mm > 0 && report.rms_mm > kMaxShareOfOther * report.other_rms_mm) {
    Note(options.common,
         fmt::format("warning: {}: side or order of the keypoints is ambiguous: a {} hand in the "
                     "order of {} fits to {:.1f} mm, the next best to {:.1f} mm. Give --hand and "
                     "--order",
                     options.recording, SideName(report.side), report.order, report.rms_mm,
                     report.other_rms_mm));
  }
  if (report.rms_mm > kDoubtfulRms_mm) {
    Note(options.common,
         fmt::format("warning: {}: keypoints are {:.0f} mm from the hand (root mean square), more "
                     "than {:g} mm: they are in another order, in image coordinates, or no hand",
                     options.recording, report.rms_mm, kDoubtfulRms_mm));
  }
  nlohmann::json metrics = JsonHead("holdfast/keypoints/1", options.common);
  metrics["options"] = {{"recording", options.recording}};
  metrics["options"].update(OptionsJson(OptionsOf(keypoints)));
  metrics["frames"] = frames;
  metrics["frame_rate_hz"] = solved.clip.frame_rate;
  metrics.update(KeypointReportJson(report));
  metrics["solve"] = {{"solve_ms", report.solve_ms},
                      {"frames_per_s", 1e3 * frames / report.solve_ms}};
  WriteClip(solved.clip, folder / "clip.npz");
  folder.WriteMetrics(metrics);
  folder.Commit();
  nlohmann::json summary = metrics;
  summary["output"] = options.output;
  PrintResult(options.common, summary,
              fmt::format("{}: {} frames at {:g} Hz of a {} hand, keypoints in the order of {}\n"
                          "  keypoints are {:.1f} mm from the hand (root mean square); scaled by "
                          "{:.3f} to the model's size\n"
                          "  solved in {:.2f} s: {:.0f} frames a second\n",
                          options.output, frames, solved.clip.frame_rate, SideName(report.side),
                          report.order, report.rms_mm, 1.0 / report.size_ratio,
                          1e-3 * report.solve_ms, 1e3 * frames / report.solve_ms));
  return report.rms_mm > kMaxRms_mm ? kFitFault : kDone;
}

int Solve(SolveCommand options) {
  if (HoldsArrays(options.recording)) return SolveHand(options);
  ResultFolder folder(options.output, options.common.force);
  const auto read = [&](const std::string& path) {
    MarkerRecording recording = ReadMarkers(path);
    for (const std::string& note : recording.notes) Note(options.common, "note: " + note);
    return recording;
  };
  const MarkerRecording recording = read(options.recording);
  std::optional<MarkerRecording> still;
  if (!options.still.empty()) still = read(options.still);
  const std::shared_ptr<const BodyModel> body = LoadBody(options.body);
  SolveMarkersOptions& solve = options.solve;
  if (!options.table.empty()) {
    solve.table = solve.table.With(MarkerTable::Read(options.table, JointOfVertices(body)));
  }
  const std::optional<LoadedObject> object = TakeObject(options, recording, solve);
  const auto begin = std::chrono::steady_clock::now();
  auto done = RunStaged(options.common, [&](const StagedProgress& progress) {
    return SolveMarkers(recording, still ? &*still : nullptr, body, solve, options.recording,
                        progress);
  });
  if (!done) return kInterrupted;
  SolvedRecording& solved = *done;
  const double solve_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  WarnOfDoubts(options, solved.report);
  if (!solved.report.converged) throw FitFailure(options.recording + ": the solve failed");
  const nlohmann::json metrics = MetricsOf(options, solved, solve_ms);
  if (object) {
    for (const std::string& note : object->notes) Note(options.common, "note: " + note);
    solved.clip.object->name = object->name;
    WriteClipFiles(solved.clip, object->mesh, folder / "");
  } else {
    WriteClip(solved.clip, folder / "clip.npz");
  }
  WriteC3d(RepairedMarkers(recording, solved), folder / "markers.c3d");
  folder.WriteMetrics(metrics);
  folder.Commit();
  nlohmann::json summary = metrics;
  summary["output"] = options.output;
  PrintResult(options.common, summary, Text(options, solved, solve_ms));
  return solved.report.rms_mm > kMaxRms_mm ? kFitFault : kDone;
}

}  // namespace

void AddSolveCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<SolveCommand>();
  CLI::App* command = app.add_subcommand(
      "solve",
      "Fit a moving body to labeled optical markers (C3D, TRC, CSV, TSV), or a hand to keypoints");
  command
      ->add_option(
          "recording", options->recording,
          "Markers: C3D, TRC, Vicon CSV or Qualisys TSV, gzipped or not; or keypoints of a "
          "hand: (frames, 21, 3), .npy .npz .json .pkl .pt")
      ->required();
  command
      ->add_option("-o,--output", options->output,
                   "Output folder: clip.npz, metrics.json, markers.c3d (labels corrected, gaps "
                   "filled), and object.ply with --object")
      ->required();
  command->add_option("--static", options->still,
                      "Static trial: the same person and markers, standing or sitting still; used "
                      "to solve body shape and marker placement");
  command->add_option(
      "--markers", options->table,
      "Table of additional marker names (CSV): name,joint,vertex,cluster; overrides known names");
  command->add_option("--object-markers", options->object_markers,
                      "Markers on the object: a CSV table name,x,y,z with their positions in the "
                      "mesh frame, meters; or only their names: cup_top,cup_left,cup_right or "
                      "'cup_*'");
  command->add_option("--object", options->object, kObjectHelp);
  AddOption(*command, "--object-scale", options->object_scale,
            "Multiplies the object's coordinates (0.001 for millimeters)", CLI::PositiveNumber);
  command->add_option("--body", options->body,
                      "Body model in place of the embedded one: SMPL-X or SMPL-H, .npz or .pkl");
  AddOptions(*command, OptionsOf(options->solve));
  AddOptions(*command, OptionsOf(options->keypoints).Without({"up"}));
  AddCommonOptions(
      *command, options->common, true,
      "  holdfast solve drink.csv --static static.csv -o drinks\n"
      "  holdfast solve drink.csv --object mug --object-markers mug.csv -o mug_drinks\n"
      "  holdfast solve drink.csv --markers names.csv --posture standing -o stands\n"
      "  holdfast solve keypoints.npy --up=-y -o hand\n"
      "docs/markers.md lists the known marker names. Joints without markers stay at rest and are\n"
      "reported. Exit code 3: the residual is above 30 mm (root mean square).\n");
  command->callback([options, &exit_code] { exit_code = Solve(*options); });
}

}  // namespace holdfast::apps
