// SPDX-License-Identifier: MIT
#include "apps/motion/reach_track.h"

#include <algorithm>

#include <fmt/format.h>

#include "apps/interrupt.h"
#include "apps/motion/reach_markers.h"
#include "apps/report_writer.h"
#include "apps/result_folder.h"
#include "generator/wandr/motion_states.h"

namespace holdfast::apps {
namespace {

nlohmann::json TrackJson(const TrackJob& job, const std::string& from, const ReachNetwork& network,
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
  return metrics;
}

std::string TrackText(const TrackJob& job, const FollowReport& report) {
  const auto frames = static_cast<double>(report.distance_m.size());
  std::string text = fmt::format("{}/clip.npz: a goal followed with the {} wrist, {:.0f} frames\n",
                                 job.output, SideName(job.follow.side), frames + 1.0);
  text += fmt::format("  {:<26}{:.1f} cm on average after the first second, {:.1f} at most\n",
                      "distance to the goal", 100.0 * report.mean_m, 100.0 * report.worst_m);
  text += fmt::format("  {:<26}{:.0f} % of frames skate, {:.0f} % in the air\n", "feet",
                      100.0 * report.skating, 100.0 * report.airborne);
  text += fmt::format("  {:<26}{:.1f} ms of one core a frame, {:.1f} at most; 33.3 is real time\n",
                      "time", 1000.0 * report.seconds / frames, 1000.0 * report.slowest_frame_s);
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
    Note(common, fmt::format("warning: interrupted after {} of {} goals: the motion until then is "
                             "in {}",
                             report.distance_m.size(), goals.size(), job.output));
  }

  ReportInput shown;
  shown.file = std::filesystem::path(job.output) / "clip.npz";
  shown.source = job.output;
  shown.clip = wandr::ClipOfStates(report.track.states.cast<double>(), person.like);
  shown.clip.action = "reach";
  shown.body = person.body;
  shown.betas = person.betas;
  // A ball each second: where the goal came by.
  std::vector<Eigen::Vector3d> balls;
  for (std::size_t t = 0; t < report.distance_m.size(); t += 30) balls.push_back(goals[t]);
  shown.marker = GoalMarkers(balls);
  const nlohmann::json metrics = TrackJson(job, from, network, report, common);
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
