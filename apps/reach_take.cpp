// SPDX-License-Identifier: MIT
#include "apps/reach_take.h"

#include <algorithm>

#include <fmt/format.h>

#include "apps/clip_input.h"
#include "apps/fit_library.h"
#include "apps/fit_metrics.h"
#include "apps/report.h"
#include "apps/result_folder.h"
#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/parallel.h"
#include "geometry/rotation.h"
#include "solver/fit/clip_state.h"
#include "solver/take/take_fit.h"
#include "solver/take/take_measures.h"
#include "solver/take/take_motion.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

constexpr int kAttempts = 3;
constexpr int kLookedAt = 4;             // motions of an attempt that a table is put to
constexpr double kLaterMotion = 0.03;    // of score: the maker has its best first
constexpr double kBodyInTable_m = 0.02;  // that another attempt may mend
constexpr double kLedByHand = 2000.0;    // FitOptions::lambda_object: from where the hand leads it
constexpr double kMissed_m = 0.02;       // a hand farther from the grasp holds nothing

// A motion that takes, and the table that keeps clear of it.
struct Candidate {
  TakeMotion motion;
  TablePlacement table;
  int attempt = 0;
  int index = 0;  // among the motions of its attempt
  double score = -1e9;

  bool Serves() const { return motion.fault.empty() && table.deepest_m <= kBodyInTable_m; }
};

double MarginOf(const TriangleMesh& mesh) {
  return std::min(0.2, 0.5 * Extent(mesh).head<2>().norm() + 0.01);
}

// The best motion of an attempt.
Candidate BestOf(const std::vector<TakenMotion>& motions, const TakePlan& plan,
                 const HandModel& hand, const BodySurface& body, const TakeObject& object,
                 const Clip& like, int threads) {
  std::vector<Candidate> all;
  all.resize(motions.size());
  ParallelFor(static_cast<int>(motions.size()), threads, [&](int i) {
    all[i].motion = MakeTakeMotion(plan, motions[i], hand, object, like);
    all[i].index = i;
    all[i].score = all[i].motion.score - kLaterMotion * i;
  });
  std::ranges::stable_sort(
      all, [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
  Candidate best;
  best.motion.fault = "no motion was made";
  for (std::size_t i = 0; i < std::min<std::size_t>(all.size(), kLookedAt); ++i) {
    if (all[i].motion.clip.NumFrames() == 0) {
      if (i == 0) best = std::move(all[i]);
      continue;
    }
    const Eigen::Vector3d place = plan.places.front();
    all[i].table = PlaceTable(place, plan.approach_yaw_rad, MarginOf(object.mesh),
                              SkinNearTable(all[i].motion.clip, body, place, threads));
    all[i].score -= 100.0 * all[i].table.deepest_m;
    if (all[i].score > best.score) best = std::move(all[i]);
  }
  return best;
}

void StandTable(const SideTable& table, Clip& clip) {
  ObjectTrack track;
  track.name = "table";
  track.mesh = "table.ply";
  track.trans = table.world_from_table.translation().replicate(1, clip.NumFrames());
  track.orient = LogSO3(table.world_from_table.linear()).replicate(1, clip.NumFrames());
  clip.table = std::move(track);
}

nlohmann::json Vector(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

nlohmann::json TakeJson(const TakePlan& plan, const Candidate& best) {
  const TakeMotion& motion = best.motion;
  const Grasp& grasp = motion.take.grasp;
  const SideTable& table = best.table.table;
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
          {"attempt", best.attempt},
          {"motion", best.index}};
}

// Deepest of hand and object in each other over frames [begin, end).
double Deepest(const ContactScore& contact, int begin, int end) {
  double deepest = 0.0;
  for (int t = begin; t < end; ++t) deepest = std::max(deepest, contact.frames[t].penetration_mm);
  return deepest;
}

struct Held {
  double error_mm = 0.0;  // of the wrist in the object's frame, from where the grasp has it
  double error_deg = 0.0;
};

// How far the object wanders in the hand while it is held.
Held WanderingInHand(const Clip& clip, const BodySurface& body, const TakeMotion& motion,
                     Side side) {
  Held held;
  BodyState state;
  for (int t = motion.times.take; t < clip.NumFrames(); ++t) {
    ForwardJoints(body.RestJoints(), clip.pose[t], clip.trans.col(t), state);
    const int wrist = WristJoint(side);
    const Eigen::Matrix3d rotation =
        state.world_rotation[wrist].transpose() * ExpSO3(clip.object->orient.col(t));
    const Eigen::Vector3d position = state.world_rotation[wrist].transpose() *
                                     (clip.object->trans.col(t) - state.joints.col(wrist));
    const Eigen::Isometry3d& grasp = motion.take.grasp.wrist_from_object;
    held.error_mm = std::max(held.error_mm, 1000.0 * (position - grasp.translation()).norm());
    held.error_deg = std::max(held.error_deg, AngleBetween(rotation, grasp.linear()) / kDegree);
  }
  return held;
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

}  // namespace

FitOutcome RunReachTake(const TakeJob& job, const TakeStart& start, const BodyMotionMaker& motion,
                        const nlohmann::json& extra, const CommonOptions& common) {
  ResultFolder folder(job.output, common.force);
  const FitOutcome stopped{kInterrupted, {}, {}};
  const int threads = NumThreads(common);
  FitLibrary library;
  constexpr int kPairVertices = 300;
  RequireGraspable(*library.Loaded(job.object, job.object_scale), false);
  const std::shared_ptr<const PreparedObject> prepared =
      library.Object(job.object, job.object_scale, kPairVertices, threads);
  for (const std::string& note : prepared->notes) Note(common, "note: " + note);
  const TakeObject object{prepared->object.mesh, prepared->solid.distance, *prepared->fit.distance};
  const HandModel hand(start.body, start.betas, job.side);
  const BodySurface body(start.body, start.betas);

  TakeRequest request;
  request.side = job.side;
  request.places = job.places;
  if (job.object_yaw_deg) request.object_yaw_rad = *job.object_yaw_deg * kDegree;
  request.style = StyleByName(job.style);
  request.pelvis = start.pelvis;
  request.seed = common.seed;
  request.threads = threads;
  TakePlan plan;
  {
    Progress progress(common, "grasp");
    plan = PlanTake(request, hand, object, [&](double share) {
      progress.Update(static_cast<int>(100 * share), 100);
      return !Interrupted();
    });
  }
  if (Interrupted()) return stopped;
  if (!plan.Found()) {
    throw FitFailure(fmt::format("{}: {}. Try the other hand, or another object size", job.object,
                                 Describe(plan.status)));
  }
  std::vector<std::string> notes;
  if (!plan.take.fault.empty()) notes.push_back("no grasp is quite right: " + plan.take.fault);

  Candidate best;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const std::vector<TakenMotion> motions = motion(plan, attempt);
    if (Interrupted()) return stopped;
    Candidate found = BestOf(motions, plan, hand, body, object, start.like, threads);
    found.attempt = attempt;
    if (attempt == 0 || found.score > best.score) best = std::move(found);
    if (best.Serves()) break;
  }
  if (best.motion.clip.NumFrames() == 0) {
    throw FitFailure(fmt::format("{}: {}. Try another --seed, or places nearer to one another",
                                 job.object, best.motion.fault));
  }
  if (best.motion.take_wrist_error_m > kMissed_m) {
    throw FitFailure(fmt::format(
        "{}: the hand stays {:.0f} cm from the object, which is too far, too high or too low for "
        "this body. Move the first --goal, or try another --seed",
        job.object, 100.0 * best.motion.take_wrist_error_m));
  }
  if (!best.motion.fault.empty()) notes.push_back("the take: " + best.motion.fault);

  FitOptions fit;
  fit.threads = threads;
  fit.lambda_object = kLedByHand;
  std::vector<FrameReport> reports;
  Clip clip;
  {
    Progress progress(common, "fit");
    clip = FitTaken(best.motion, hand, prepared->fit, fit, &reports, [&](int done, int total) {
      progress.Update(done, total);
      return !Interrupted();
    });
  }
  if (Interrupted()) return stopped;
  clip.object->name = prepared->object.name;
  clip.object->mesh = "object.ply";
  clip.action = "take";
  if (clip.betas.size() == 0 || clip.betas.isZero(0.0)) clip.body_model = start.body->Name();
  StandTable(best.table.table, clip);

  ContactProtocol protocol;
  protocol.threads = threads;
  // Of the frames from the take on the hand holds; before, it comes and closes.
  std::vector<std::uint8_t> holding(static_cast<std::size_t>(clip.NumFrames()), 0);
  std::fill(holding.begin() + best.motion.times.take, holding.end(), HoldingBit(job.side));
  const ContactScore contact =
      ScoreContact(MeasureHands(clip, {&hand}, holding, prepared->solid, protocol, common));
  if (Interrupted()) return stopped;
  const TakeTimes& times = best.motion.times;
  const TakeMeasures measured = MeasureTake(clip, body, job.side, object, best.table.table,
                                            times.take, times.goals, plan.places, threads);
  const Held held = WanderingInHand(clip, body, best.motion, job.side);
  const int count = clip.NumFrames();

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
  metrics["take"] = TakeJson(plan, best);
  nlohmann::json& summary = metrics["summary"];
  summary["frames"] = count;
  summary["take_wrist_error_mm"] = 1000.0 * best.motion.take_wrist_error_m;
  summary["take_hand_error_deg"] = best.motion.take_hand_error_rad / kDegree;
  summary["coming_penetration_mm"] = Deepest(contact, times.begin, times.arrive);
  summary["closing_penetration_mm"] = Deepest(contact, times.arrive, times.take);
  summary["holding_penetration_mm"] = Deepest(contact, times.take, count);
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
  summary["object_wanders_in_hand_mm"] = held.error_mm;
  summary["object_wanders_in_hand_deg"] = held.error_deg;
  summary["arm_lacked_before_leaning_m"] = best.motion.shoulder_lacked_m;
  summary["carry_arm_lacked_m"] = best.motion.max_lacks_m;
  summary["carry_hand_error_deg"] = best.motion.max_hand_error_rad / kDegree;
  metrics["notes"] = notes;
  metrics["per_frame"]["object_tilt_deg"] = measured.tilt_deg;
  for (int t = 0; t < count; ++t) {
    metrics["per_frame"]["arm_lacks_mm"].push_back(1000.0 * best.motion.lacks_m[t]);
    metrics["per_frame"]["hand_error_deg"].push_back(best.motion.hand_error_rad[t] / kDegree);
  }
  for (const ContactScore::Frame& frame : contact.frames) {
    metrics["per_frame"]["max_penetration_mm"].push_back(frame.penetration_mm);
    metrics["per_frame"]["min_distance_mm"].push_back(frame.min_distance_mm);
  }
  for (const std::string& note : notes) Note(common, "warning: " + note);

  const TriangleMesh table = best.table.table.Mesh();
  WriteClip(clip, folder / "clip.npz");
  WriteMesh(prepared->object.mesh, folder / "object.ply");
  WriteMesh(table, folder / "table.ply");
  WriteAtomically(folder / "metrics.json", metrics.dump(1) + "\n");
  if (job.write_report) {
    ClipInput shown;
    shown.source = job.output;
    shown.file = fs::path(job.output) / "clip.npz";
    shown.clip = clip;
    shown.body = start.body;
    shown.betas = start.betas;
    shown.object = prepared->object.mesh;
    shown.table = table;
    shown.metrics = metrics;
    WriteReportBeside({&shown, 1}, folder / "report.html", common);
    if (Interrupted()) return stopped;
  }
  folder.Commit();

  FitOutcome outcome;
  outcome.text = Text(job, metrics["take"], summary);
  outcome.summary = std::move(metrics);
  outcome.summary.erase("per_frame");
  outcome.summary["output"] = job.output;
  return outcome;
}

}  // namespace holdfast::apps
