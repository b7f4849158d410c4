// SPDX-License-Identifier: MIT
#include "apps/motion/reach_take.h"

#include <algorithm>

#include <fmt/format.h>

#include "apps/clip_input.h"
#include "apps/fit_job.h"
#include "apps/report_writer.h"
#include "apps/result_folder.h"
#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/rotation.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

nlohmann::json Vector(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

nlohmann::json TakeJson(const TakeReport& report) {
  const TakePlan& plan = report.plan;
  const TakeMotion& motion = report.motion;
  const Grasp& grasp = motion.take.grasp;
  const SideTable& table = report.table;
  return {{"hand", SideName(plan.side)},
          {"object_yaw_deg", motion.standing.yaw_rad / kDegree},
          {"grasp",
           {{"style", StyleName(grasp.style)},
            {"status", Describe(plan.status)},
            {"score", grasp.score},
            {"wrench_quality", grasp.wrench_quality},
            {"skin_in_object_mm", grasp.max_penetration_mm},
            {"below_bottom_mm", grasp.below_bottom_mm}}},
          {"approach",
           {{"standoff_m", motion.take.approach.standoff_m},
            {"openness", motion.take.approach.openness},
            {"through_object_mm", motion.take.approach.through_mm},
            {"below_object_mm", motion.take.approach.below_mm}}},
          {"score", motion.take.score},
          {"fault", motion.take.fault},
          {"arm_discomfort", motion.take.arm.discomfort},
          {"frames",
           {{"arm_begins", motion.times.begin},
            {"on_line", motion.times.pregrasp},
            {"arrives", motion.times.arrive},
            {"taken", motion.times.take},
            {"at_goals", motion.times.goals}}},
          {"table",
           {{"top_middle_m", Vector(table.world_from_table.translation())},
            {"yaw_deg", LogSO3(table.world_from_table.linear()).z() / kDegree},
            {"width_m", table.width_m},
            {"height_m", table.height_m}}},
          {"attempt", report.attempt},
          {"motion", report.index}};
}

nlohmann::json TakeSummaryJson(const TakeReport& report) {
  const TakeMotion& motion = report.motion;
  const TakeTimes& times = motion.times;
  const TakeMeasures& measured = report.measured;
  const ContactScore& contact = report.contact;
  const int count = report.clip.NumFrames();
  nlohmann::json summary;
  summary["frames"] = count;
  summary["take_wrist_error_mm"] = 1000.0 * motion.take_wrist_error_m;
  summary["take_hand_error_deg"] = motion.take_hand_error_rad / kDegree;
  summary["coming_penetration_mm"] = DeepestOver(contact, times.begin, times.arrive);
  summary["closing_penetration_mm"] = DeepestOver(contact, times.arrive, times.take);
  summary["holding_penetration_mm"] = DeepestOver(contact, times.take, count);
  double held_depth_mm = 0.0;
  for (int t = times.take; t < count; ++t) held_depth_mm += contact.frames[t].penetration_mm;
  summary["contact"] = {{"mean_max_penetration_mm", held_depth_mm / (count - times.take)},
                        {"frames_in_contact_ratio", contact.contact_frames_ratio.value_or(0.0)}};
  summary["object_in_table_mm"] = measured.object_in_table_mm;
  summary["hand_in_table_mm"] = measured.hand_in_table_mm;
  summary["body_in_table_mm"] = measured.body_in_table_mm;
  summary["body_in_table_frame"] = measured.body_in_table_frame;
  summary["moved_before_take_mm"] = measured.moved_before_take_mm;
  summary["take_jump_mm"] = measured.take_jump_mm;
  summary["max_tilt_deg"] = measured.max_tilt_deg;
  summary["max_object_acceleration_m_s2"] = measured.max_acceleration;
  summary["max_object_acceleration_frame"] = measured.max_acceleration_frame;
  summary["goal_distance_m"] = measured.goal_m;
  summary["object_wanders_in_hand_mm"] = report.wanders_mm;
  summary["object_wanders_in_hand_deg"] = report.wanders_deg;
  summary["arm_lacked_before_leaning_m"] = motion.shoulder_lacked_m;
  summary["carry_arm_lacked_m"] = motion.max_lacks_m;
  summary["carry_hand_error_deg"] = motion.max_hand_error_rad / kDegree;
  return summary;
}

nlohmann::json TakeMetricsJson(const TakeJob& job, const TakeReport& report,
                               const nlohmann::json& extra, const CommonOptions& common) {
  const TakeMotion& motion = report.motion;
  const ContactScore& contact = report.contact;
  const TakeMeasures& measured = report.measured;
  const int count = report.clip.NumFrames();
  nlohmann::json metrics = JsonHead("holdfast/reach-take/1", common);
  metrics.update(extra);
  metrics["options"]["object"] = job.object;
  metrics["options"]["object_scale"] = job.object_scale;
  metrics["options"]["style"] = job.style;
  for (const Eigen::Vector3d& place : job.places) {
    metrics["options"]["places_m"].push_back(Vector(place));
  }
  metrics["options"]["object_yaw_deg"] =
      job.object_yaw_deg ? nlohmann::json(*job.object_yaw_deg) : nullptr;
  metrics["take"] = TakeJson(report);
  metrics["summary"] = TakeSummaryJson(report);
  metrics["notes"] = report.notes;
  metrics["per_frame"]["object_tilt_deg"] = measured.tilt_deg;
  for (int t = 0; t < count; ++t) {
    metrics["per_frame"]["arm_lacks_mm"].push_back(1000.0 * motion.lacks_m[t]);
    metrics["per_frame"]["hand_error_deg"].push_back(motion.hand_error_rad[t] / kDegree);
  }
  for (const ContactScore::Frame& frame : contact.frames) {
    metrics["per_frame"]["max_penetration_mm"].push_back(frame.penetration_mm);
    metrics["per_frame"]["min_distance_mm"].push_back(frame.min_distance_mm);
  }
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
  text += fmt::format("  {:<26}{:.2f} mm and {:.2f} deg off the grasp\n", "hand at the take",
                      number("take_wrist_error_mm"), number("take_hand_error_deg"));
  text += fmt::format("  {:<26}{:.1f} mm coming, {:.1f} mm closing, {:.1f} mm holding\n",
                      "hand in object, deepest", number("coming_penetration_mm"),
                      number("closing_penetration_mm"), number("holding_penetration_mm"));
  text += fmt::format("  {:<26}body {:.0f} mm, hand {:.0f} mm, object {:.1f} mm\n",
                      "in the table, deepest", number("body_in_table_mm"),
                      number("hand_in_table_mm"), number("object_in_table_mm"));
  text += fmt::format("  {:<26}{:.1f} deg at most, {:.1f} m/s^2 at most\n", "object carried",
                      number("max_tilt_deg"), number("max_object_acceleration_m_s2"));
  for (const nlohmann::json& goal : summary["goal_distance_m"]) {
    text +=
        fmt::format("  {:<26}{:.1f} cm\n", "from where it shall be", 100.0 * goal.get<double>());
  }
  return text;
}

void RequireTaken(const TakeReport& report, const TakeJob& job) {
  if (report.status == TakeStatus::kNoGrasp) {
    throw FitFailure(fmt::format("{}: {}. Try the other hand, or another object size", job.object,
                                 Describe(report.plan.status)));
  }
  if (report.status == TakeStatus::kNoMotion) {
    throw FitFailure(fmt::format("{}: {}. Try another --seed, or places nearer to one another",
                                 job.object, report.motion.fault));
  }
  if (report.status == TakeStatus::kMissed) {
    throw FitFailure(fmt::format(
        "{}: the hand stays {:.0f} cm from the object, which is too far, too high or too low for "
        "this body. Move the first --goal, or try another --seed",
        job.object, 100.0 * report.motion.take_wrist_error_m));
  }
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
  RequireTaken(report, job);
  nlohmann::json metrics = TakeMetricsJson(job, report, extra, common);
  for (const std::string& note : report.notes) Note(common, "warning: " + note);

  const TriangleMesh table = report.table.Mesh();
  WriteClip(report.clip, folder / "clip.npz");
  WriteMesh(object->object.mesh, folder / "object.ply");
  WriteMesh(table, folder / "table.ply");
  WriteAtomically(folder / "metrics.json", metrics.dump(1) + "\n");
  if (job.write_report) {
    ClipInput shown;
    shown.source = job.output;
    shown.file = fs::path(job.output) / "clip.npz";
    shown.clip = report.clip;
    shown.body = person.body;
    shown.betas = person.betas;
    shown.object = object->object.mesh;
    shown.table = table;
    shown.metrics = metrics;
    WriteReportBeside({&shown, 1}, folder / "report.html", common);
    if (Interrupted()) return stopped;
  }
  folder.Commit();

  Outcome outcome;
  outcome.text = Text(job, metrics["take"], metrics["summary"]);
  outcome.summary = std::move(metrics);
  outcome.summary.erase("per_frame");
  outcome.summary["output"] = job.output;
  return outcome;
}

}  // namespace holdfast::apps
