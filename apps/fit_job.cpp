// SPDX-License-Identifier: MIT
#include "apps/fit_job.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <future>
#include <map>
#include <memory>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/clip_input.h"
#include "apps/output.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/error.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/io/mesh/textured_mesh.h"
#include "geometry/mesh/mesh.h"
#include "geometry/rotation.h"
#include "geometry/suggestion.h"
#include "solver/carry/carry_json.h"

namespace holdfast::apps {
namespace {

// Loads the motion and its person.
LoadedClip MotionOf(const FitCommand& fit, const std::shared_ptr<const BodyModel>& body,
                    const CommonOptions& common) {
  if (!fit.motion) return LoadClip(fit.job.clip, body, common);
  LoadedClip loaded;
  loaded.clip = *fit.motion;
  loaded.body = BodyOfClip(fit.job.clip, loaded.clip, body, loaded.notes);
  for (const std::string& note : loaded.notes) Note(common, "note: " + note);
  return loaded;
}

std::string SwitchesText(const nlohmann::json& switches) {
  std::string text;
  for (const nlohmann::json& change : switches) {
    text += fmt::format("  hands over          frame {}, {} to {} (confidence {:.2f})",
                        change["frame"].get<int>(), change["from"].get<std::string>(),
                        change["to"].get<std::string>(), change["confidence"].get<double>());
    if (change.contains("grasp")) {
      const nlohmann::json& grasp = change["grasp"];
      text += fmt::format(
          ", wrists moved by {:.0f} mm and {:.0f} deg ({}), {:.0f} mm and {:.0f} deg ({})",
          grasp["giver_moved_mm"].get<double>(), grasp["giver_turned_deg"].get<double>(),
          change["from"].get<std::string>(), grasp["receiver_moved_mm"].get<double>(),
          grasp["receiver_turned_deg"].get<double>(), change["to"].get<std::string>());
    }
    text += "\n";
  }
  return text;
}

std::string DrinkText(const CarryReport& report) {
  if (!report.drunk) return {};
  const DrinkTimes& times = report.drink->times;
  return fmt::format(
      "  drinks              frames {} to {}; rim {:.0f} mm from the mouth in frame {}, tilted "
      "{:.0f} "
      "deg\n",
      times.lift, times.put_down, 1e3 * report.drunk->rim_from_mouth_m, times.drink,
      report.drunk->tilt_rad / kDegree);
}

void WriteResult(const FitCommand& fit, const FitRun& run, const nlohmann::json& metrics,
                 ResultFolder& folder, const CommonOptions& common) {
  const TriangleMesh& mesh = run.object->object.mesh;
  WriteClipFiles(run.report.clip, mesh, folder / "");
  nlohmann::json written = folder.WriteMetrics(metrics);
  // Reports take megabytes each, so batch jobs do not write them.
  if (fit.write_report && !InBatch()) {
    ReportInput shown;
    shown.source = fit.output;
    shown.file = std::filesystem::path(fit.output) / "clip.npz";
    shown.clip = run.report.clip;
    shown.body = run.body.model;
    shown.betas = run.body.betas;
    shown.object = mesh;
    shown.metrics = std::move(written);
    WriteReportBeside({&shown, 1}, folder / "report.html", common);
  }
  folder.Commit();
}

// Logs for --verbose how the solver ended: number of frames per stop reason, and totals.
void TellConvergence(const FitResult& fit, const CommonOptions& common) {
  std::map<std::string, int> stops;
  int iterations = 0;
  double most_ms = 0.0;
  for (const FrameReport& frame : fit.frames) {
    ++stops[std::string(StopReasonName(frame.stop))];
    iterations += frame.iterations;
    most_ms = std::max(most_ms, frame.solve_ms);
  }
  std::vector<std::string> parts;
  for (const auto& [stop, count] : stops) parts.push_back(fmt::format("{} {}", count, stop));
  Detail(common, "solver",
         fmt::format("solver: frames: {}; {} iterations in total, slowest frame {:.1f} ms",
                     fmt::join(parts, ", "), iterations, most_ms),
         {{"stops", stops}, {"iterations", iterations}, {"slowest_frame_ms", most_ms}});
}

}  // namespace

std::string SummaryText(const nlohmann::json& summary, const ContactProtocol& protocol) {
  const auto number = [&](const char* name) {
    const nlohmann::json& value = summary.at(name);
    return value.is_null() ? 0.0 : value.get<double>();
  };
  return fmt::format(
      "  in contact          {:.1f} % of the frames held ({:.1f} % of the hand within {:g} mm)\n"
      "  penetration         deepest {:.2f} mm, both ways; mean over frames: deepest {:.2f} mm, "
      "hand vertices inside {:.2f} mm\n"
      "  intersection        {:.3f} cm3 (mean; {:g} mm voxels)\n"
      "  solved              {:.2f} ms per frame (median), {:g} iterations; {} failed\n",
      100.0 * number("frames_in_contact_ratio"), 100.0 * number("contact_ratio"),
      protocol.contact_threshold_mm, number("max_penetration_depth_mm"),
      number("mean_max_penetration_depth_mm"), number("mean_penetration_depth_mm"),
      number("mean_intersection_volume_cm3"), protocol.voxel_mm, number("solve_ms_median"),
      number("iterations_median"), summary.at("frames_failed").get<int>());
}

std::string ClearanceText(const ClearanceReport& report) {
  const double deep_m = ClearanceOptions{}.deep_m;
  std::string left = fmt::format("{} of {} frames deeper than {:g} mm", report.deep,
                                 report.frames.size(), 1e3 * deep_m);
  const auto is_deep = [&](std::size_t t) {
    return t < report.frames.size() && report.frames[t].depth_m > deep_m;
  };
  std::string_view before = ": frames ";
  for (std::size_t t = 0, begin = 0; t < report.frames.size(); ++t) {
    if (!is_deep(t)) continue;
    if (t == 0 || !is_deep(t - 1)) begin = t;
    if (is_deep(t + 1)) continue;
    left += fmt::format("{}{}", before, begin);
    if (t > begin) left += fmt::format("-{}", t);
    before = ", ";
  }
  if (report.moved) {
    return fmt::format(
        "  body                wrists were moved by up to {:.1f} cm and {:.0f} deg so that arms "
        "and object do not penetrate body or table; {} (before: {}, up to {:.0f} mm)\n",
        100.0 * std::max(report.shift_max_m, report.free_shift_max_m),
        report.turn_max_rad / kDegree, left, report.deep_before, 1e3 * report.worst_before_m);
  }
  if (report.deep == 0) return {};
  return fmt::format("  body                the {} penetrates the {} by up to {:.0f} mm; {}\n",
                     MeetingPartName(report.worst_part), report.worst_in_table ? "table" : "body",
                     1e3 * report.worst_m, left);
}

void AddFitOptions(CLI::App& command, FitCommand& fit, const std::vector<std::string>& without) {
  command.add_option(
      "--body", fit.body,
      "Body model: SMPL-X, SMPL-H, or MANO for a hand alone (.npz, .pkl); the embedded "
      "body if left out");
  command.add_flag_callback(
      "--no-report", [&out = fit.write_report] { out = false; }, "Leave out report.html");
  AddOptions(command, OptionsOf(fit.job).Without(without));
  AddGraspPlaceOptions(command, fit.place, "The grasp");
  for (const char* new_grasp : {"--regrasp", "--at", "--region", "--avoid"}) {
    command.get_option("--keep-grasp")->excludes(command.get_option(new_grasp));
    command.get_option("--first-grasp")->excludes(command.get_option(new_grasp));
  }
  command.get_option("--first-grasp")->excludes(command.get_option("--keep-grasp"));
  command.get_option("--first-grasp-body")->needs(command.get_option("--first-grasp"));
}

Outcome RunFitCommand(const FitCommand& fit, const CommonOptions& common, FitLibrary& library) {
  const auto begin = std::chrono::steady_clock::now();
  ResultFolder folder(fit.output, common.force);
  FitJob job = fit.job;
  CarryOptions& carry = job.carry;
  carry.seed = common.seed;
  carry.threads = NumThreads(common);
  // Reads the object concurrently. Its errors are reported after the motion's, on the next call.
  const auto object_read =
      std::async(carry.threads > 1 ? std::launch::async : std::launch::deferred,
                 [&] { library.Loaded(job.object, carry.object_scale); });
  FitInput input;
  input.motion = MotionOf(fit, library.Body(fit.body), common);
  input.made = fit.motion.has_value();
  input.object = library.Loaded(job.object, carry.object_scale);
  input.prepare = [&] {
    auto object =
        library.Object(job.object, carry.object_scale, job.object_vertices, carry.threads);
    const auto vertices = object->object.mesh.NumVertices();
    Detail(common, "loaded", fmt::format("loaded {}: {} vertices", job.object, vertices),
           {{"file", job.object}, {"vertices", vertices}});
    return object;
  };
  carry.place = WantedPlace(fit.place, job.object, carry.object_scale);

  StageProgress progress(common);
  const FitRun run = RunFit(
      job, std::move(input), [&](const std::string& text) { Note(common, text); },
      [&](const char* stage, int done, int total) {
        progress.Update(stage, done, total);
        return !Interrupted();
      });
  progress.End();
  if (Interrupted()) return {kInterrupted, {}, {}};

  TellConvergence(run.report.fit, common);
  nlohmann::json metrics = JsonHead("holdfast/fit/1", common);
  metrics.update(FitMetricsJson(job, run));
  metrics["options"]["body"] = fit.body.empty() ? "holdfast_neutral" : fit.body;
  if (fit.place.Given()) metrics["options"]["place"] = GraspPlaceJson(fit.place);
  if (!fit.extra.is_null()) metrics.update(fit.extra);
  if (fit.measure) fit.measure(run.report.clip, metrics);
  WriteResult(fit, run, metrics, folder, common);

  Outcome outcome;
  outcome.exit_code = Interrupted() ? kInterrupted : run.Sound() ? kDone : kFitFault;
  outcome.text = fmt::format(
      "{}/clip.npz: {} held by {}\n"
      "{}{}{}{}  total time          {:.2f} s, including the grasp search\n",
      fit.output, run.object->object.name, HoldersText(CountHeld(run.report.clip.holding_hand)),
      SummaryText(metrics["summary"], carry.protocol), ClearanceText(run.report.clearance),
      DrinkText(run.report), SwitchesText(metrics["switches"]),
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  metrics.erase("per_frame");
  metrics["output"] = fit.output;
  outcome.summary = std::move(metrics);
  return outcome;
}

namespace {

namespace fs = std::filesystem;

[[noreturn]] void Unknown(const char* option, const std::string& name,
                          const std::vector<MeshGroup>& groups, const std::string& object) {
  const std::string where = fmt::format("{} {}", option, name);
  if (groups.empty()) {
    throw Error(where, fmt::format("is not a file, and {} has no named parts", object),
                "Name a group, object or material of an .obj file, or give a file that lists "
                "vertices, or a point with --at");
  }
  std::vector<std::string> names;
  for (const MeshGroup& group : groups) names.push_back(group.name);
  throw Error(where, fmt::format("is neither a part of {} nor a file", object),
              fmt::format("{}Choose one of: {}", Suggestion(name, names), fmt::join(names, ", ")));
}

// Faces of all named parts, in the unit of the file.
TriangleMesh SurfaceNamed(const char* option, const std::vector<std::string>& asked,
                          const std::vector<MeshGroup>& groups, const std::string& object) {
  TriangleMesh surface;
  surface.vertices.resize(3, 0);
  surface.faces.resize(3, 0);
  for (const std::string& name : asked) {
    bool found = false;
    for (const MeshGroup& group : groups) {
      if (group.name != name) continue;
      Append(group.surface, surface);
      found = true;
    }
    if (found) continue;
    if (!fs::is_regular_file(name)) Unknown(option, name, groups, object);
    if (!fs::is_regular_file(object)) {
      throw Error(fmt::format("{} {}", option, name),
                  fmt::format("lists vertices of a mesh file, but {} is not a file", object),
                  "Give the object as a mesh file");
    }
    const TriangleMesh mesh = ReadMesh(object);
    try {
      Append(ReadVertexRegion(name, mesh), surface);
    } catch (const Error& error) {
      throw Error(fmt::format("{} {}", option, error.Where()), error.Problem(), error.Remedy());
    }
  }
  return surface;
}

}  // namespace

void AddGraspPlaceOptions(CLI::App& command, GraspPlaceInput& input, const std::string& group) {
  command
      .add_option(
          "--at", input.at,
          "Grasp the object at this point: X,Y,Z in the object frame, meters, after scaling")
      ->delimiter(',')
      ->expected(3)
      ->type_name("X,Y,Z")
      ->group(group);
  command
      .add_option("--region", input.region,
                  "Grasp only this part: a group, object or material of the .obj file, or a file "
                  "of vertex indices, from 0. May be repeated")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->type_name("NAME|FILE")
      ->group(group);
  command
      .add_option("--avoid", input.avoid,
                  "Do not touch this part, given as for --region; or keep the hand out of a ball: "
                  "X,Y,Z,RADIUS in the object frame, meters, after scaling. May be repeated")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->type_name("NAME|FILE|X,Y,Z,RADIUS")
      ->group(group);
}

std::optional<GraspPlace::Wanted> WantedPlace(const GraspPlaceInput& input,
                                              const std::string& path_or_name, double scale) {
  if (!input.Given()) return std::nullopt;
  std::vector<MeshGroup> groups;
  if (fs::is_regular_file(path_or_name)) groups = ReadMeshGroups(path_or_name);
  GraspPlace::Wanted wanted;
  wanted.region = SurfaceNamed("--region", input.region, groups, path_or_name);
  std::vector<std::string> avoided_parts;
  for (const std::string& avoid : input.avoid) {
    if (const auto ball = NumbersFrom(avoid, 4)) {
      wanted.avoid_balls.push_back({Eigen::Vector3d(ball->data()), ball->at(3)});
    } else {
      avoided_parts.push_back(avoid);
    }
  }
  wanted.avoid = SurfaceNamed("--avoid", avoided_parts, groups, path_or_name);
  wanted.region.vertices *= scale;
  wanted.avoid.vertices *= scale;
  if (!input.at.empty()) wanted.at = Eigen::Vector3d(input.at[0], input.at[1], input.at[2]);
  return wanted;
}

nlohmann::json GraspPlaceJson(const GraspPlaceInput& input) {
  if (!input.Given()) return nullptr;
  return {{"at_m", input.at}, {"region", input.region}, {"avoid", input.avoid}};
}

}  // namespace holdfast::apps
