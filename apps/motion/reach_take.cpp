// SPDX-License-Identifier: MIT
#include "apps/motion/reach_take.h"

#include <algorithm>

#include <fmt/format.h>

#include "apps/clip_input.h"
#include "apps/fit_job.h"
#include "apps/output.h"
#include "generator/wandr/motion_states.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/error.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/rotation.h"
#include "solver/reach/reach_and_take.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

nlohmann::json TakeMetricsJson(const TakeJob& job, const TakeReport& report,
                               const nlohmann::json& extra, const CommonOptions& common) {
  nlohmann::json metrics = JsonHead("holdfast/reach-take/1", common);
  metrics.update(extra);
  metrics["options"]["object"] = job.object;
  metrics["options"]["object_scale"] = job.object_scale;
  metrics["options"]["style"] = job.style;
  for (const Eigen::Vector3d& place : job.places) {
    metrics["options"]["places_m"].push_back({place.x(), place.y(), place.z()});
  }
  metrics["options"]["object_yaw_deg"] =
      job.object_yaw_deg ? nlohmann::json(*job.object_yaw_deg) : nullptr;
  metrics.update(TakeJson(report));
  return metrics;
}

std::string Text(const TakeJob& job, const nlohmann::json& take, const nlohmann::json& summary) {
  const double rate = 30.0;
  const auto number = [&](const char* name) { return summary[name].get<double>(); };
  std::string text = fmt::format(
      "{}/clip.npz: {} taken after {:.1f} s with the {} hand ({}), {} frames ({:.1f} s)\n",
      job.output, job.object, take["frames"]["taken"].get<int>() / rate,
      take["hand"].get<std::string>(), take["grasp"]["style"].get<std::string>(),
      summary["frames"].get<int>(), summary["frames"].get<int>() / rate);
  text += fmt::format("  {:<26}{:.2f} mm and {:.2f} deg from the grasp\n", "hand at the take",
                      number("take_wrist_error_mm"), number("take_hand_error_deg"));
  text += fmt::format("  {:<26}{:.1f} mm approaching, {:.1f} mm closing, {:.1f} mm holding\n",
                      "hand in object, deepest", number("coming_penetration_mm"),
                      number("closing_penetration_mm"), number("holding_penetration_mm"));
  text += fmt::format("  {:<26}body {:.0f} mm, hand {:.0f} mm, object {:.1f} mm\n",
                      "in the table, deepest", number("body_in_table_mm"),
                      number("hand_in_table_mm"), number("object_in_table_mm"));
  text += fmt::format("  {:<26}{:.1f} deg at most, {:.1f} m/s^2 at most\n", "object carried",
                      number("max_tilt_deg"), number("max_object_acceleration_m_s2"));
  for (const nlohmann::json& goal : summary["goal_distance_m"]) {
    text += fmt::format("  {:<26}{:.1f} cm\n", "distance to the goal", 100.0 * goal.get<double>());
  }
  return text;
}

}  // namespace

Outcome RunReachTake(const TakeJob& job, const ReachPerson& person,
                     const wandr::NetworkWeights& network, const ReachOptions& options,
                     const nlohmann::json& extra, const CommonOptions& common) {
  ResultFolder folder(job.output, common.force);
  const Outcome stopped{kInterrupted, {}, {}};
  const int threads = NumThreads(common);
  FitLibrary library;
  constexpr int kPairVertices = 300;
  RequireGraspable(*library.Loaded(job.object, job.object_scale), false);
  const std::shared_ptr<const PreparedObject> object =
      library.Object(job.object, job.object_scale, kPairVertices, threads);
  for (const std::string& note : object->notes) Note(common, "note: " + note);

  TakeRequest request;
  request.side = job.side;
  request.places = job.places;
  if (job.object_yaw_deg) request.object_yaw_rad = *job.object_yaw_deg * kDegree;
  request.style = StyleByName(job.style);
  request.seed = common.seed;
  request.threads = threads;
  StageProgress progress(common);
  const TakeReport report = ReachAndTake(person, network, request, *object, options,
                                         [&](const char* stage, int done, int total) {
                                           progress.Update(stage, done, total);
                                           return !Interrupted();
                                         });
  progress.End();
  if (Interrupted()) return stopped;
  RequireTaken(report, job.object);
  nlohmann::json metrics = TakeMetricsJson(job, report, extra, common);
  for (const std::string& note : report.notes) Note(common, "warning: " + note);

  WriteClipFiles(report.clip, object->object.mesh, folder / "");
  nlohmann::json written = folder.WriteMetrics(metrics);
  if (job.write_report) {
    ReportInput shown;
    shown.source = job.output;
    shown.file = fs::path(job.output) / "clip.npz";
    shown.clip = report.clip;
    shown.body = person.body;
    shown.betas = person.betas;
    shown.object = object->object.mesh;
    shown.metrics = std::move(written);
    WriteReportBeside({&shown, 1}, folder / "report.html", common);
  }
  folder.Commit();

  Outcome outcome;
  outcome.exit_code = Interrupted() ? kInterrupted : kDone;
  outcome.text = Text(job, metrics["take"], metrics["summary"]);
  outcome.summary = std::move(metrics);
  outcome.summary.erase("per_frame");
  outcome.summary["output"] = job.output;
  return outcome;
}

namespace {

nlohmann::json TrackJson(const TrackJob& job, std::span<const Eigen::Vector3d> goals,
                         const std::string& from, const ReachNetwork& network,
                         const FollowReport& report, const CommonOptions& common) {
  const auto frames = static_cast<double>(report.distance_m.size());
  nlohmann::json metrics = JsonHead("holdfast/reach-track/1", common);
  metrics["options"] = {{"track", job.goals},
                        {"rate_hz", job.rate_hz ? nlohmann::json(*job.rate_hz) : nullptr},
                        {"pushes", job.pushes},
                        {"from", from},
                        {"wrist", SideName(job.follow.side)},
                        {"candidates", job.follow.candidates},
                        {"horizon_frames", job.follow.horizon},
                        {"sigma", job.follow.sigma}};
  metrics["network"] = NetworkJson(network);
  metrics["summary"] = {{"frames", report.distance_m.size()},
                        {"interrupted", report.stopped},
                        {"goal_distance_after_1_s_mean_m", report.mean_m},
                        {"goal_distance_after_1_s_max_m", report.worst_m},
                        {"foot_skating_ratio", report.skating},
                        {"airborne_ratio", report.airborne},
                        {"lowest_pelvis_m", report.lowest_pelvis_m},
                        {"lowest_foot_joint_m", report.lowest_foot_m},
                        {"acceleration_mean_m_s2", report.acceleration_m_s2},
                        {"ms_per_frame", 1000.0 * report.seconds / frames},
                        {"ms_slowest_frame", 1000.0 * report.slowest_frame_s}};
  std::vector<double> distance = {report.distance_m.front()};
  distance.insert(distance.end(), report.distance_m.begin(), report.distance_m.end());
  metrics["per_frame"]["goal_distance_m"] = distance;
  for (std::size_t t = 0; t < distance.size(); ++t) {
    const Eigen::Vector3d& goal = goals[std::max<std::size_t>(t, 1) - 1];
    metrics["per_frame"]["goal_m"].push_back({goal.x(), goal.y(), goal.z()});
  }
  return metrics;
}

std::string TrackText(const TrackJob& job, const FollowReport& report) {
  const auto frames = static_cast<double>(report.distance_m.size());
  std::string text =
      fmt::format("{}/clip.npz: moving goal followed with the {} wrist, {:.0f} frames\n",
                  job.output, SideName(job.follow.side), frames + 1.0);
  text += fmt::format("  {:<26}{:.1f} cm on average after the first second, at most {:.1f} cm\n",
                      "distance to the goal", 100.0 * report.mean_m, 100.0 * report.worst_m);
  text += fmt::format("  {:<26}{:.0f} % of frames skate, {:.0f} % in the air\n", "feet",
                      100.0 * report.skating, 100.0 * report.airborne);
  text += fmt::format(
      "  {:<26}{:.1f} ms per frame on one core, at most {:.1f} ms (real time: 33.3 ms)\n", "time",
      1000.0 * report.seconds / frames, 1000.0 * report.slowest_frame_s);
  return text;
}

}  // namespace

Outcome RunReachTrack(const TrackJob& job, const ReachPerson& person, const std::string& from,
                      const ReachNetwork& network, const CommonOptions& common) {
  const std::vector<Eigen::Vector3d> goals = ReadGoalTrack(job.goals, job.rate_hz);
  std::vector<TrackPush> pushes;
  for (const std::string& text : job.pushes) pushes.push_back(ParsePush(text));
  ResultFolder folder(job.output, common.force);
  Progress progress(common, "reach");
  const FollowReport report =
      FollowTrack(person, network.weights, goals, pushes, job.follow, [&](int done, int total) {
        if (done > 0) progress.Update(done, total);
        return !Interrupted();
      });
  if (report.distance_m.empty()) return {kInterrupted, {}, {}};
  if (report.stopped) {
    Note(common,
         fmt::format("warning: interrupted after {} of {} goals: the motion up to there is in {}",
                     report.distance_m.size(), goals.size(), job.output));
  }

  ReportInput shown;
  shown.file = std::filesystem::path(job.output) / "clip.npz";
  shown.source = job.output;
  shown.clip = wandr::ClipOfStates(report.track.states.cast<double>(), person.like);
  shown.clip.action = "reach";
  shown.body = person.body;
  shown.betas = person.betas;
  const nlohmann::json metrics = TrackJson(job, goals, from, network, report, common);
  WriteClip(shown.clip, folder / "clip.npz");
  shown.metrics = folder.WriteMetrics(metrics);
  if (job.write_report && !report.stopped) {
    const std::vector<ReportInput> all = {shown};
    WriteReportBeside(all, folder / "report.html", common);
  }
  folder.Commit();
  Outcome outcome;
  outcome.exit_code = Interrupted() ? kInterrupted : kDone;
  outcome.text = TrackText(job, report);
  outcome.summary = metrics;
  outcome.summary["output"] = job.output;
  return outcome;
}

}  // namespace holdfast::apps
