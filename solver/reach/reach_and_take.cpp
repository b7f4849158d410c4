// SPDX-License-Identifier: MIT
#include "solver/reach/reach_and_take.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/rotation.h"
#include "solver/reach/reach_motions.h"

namespace holdfast {
namespace {

constexpr int kShortestStay = 12;       // frames
constexpr std::uint64_t kOther = 7919;  // seed offset between attempts

ReachObstacle TableOf(const TakePlan& plan, Side side, int threads) {
  TriangleMesh table = plan.table.Mesh();
  for (Eigen::Index i = 0; i < table.vertices.cols(); ++i) {
    table.vertices.col(i) = plan.table.world_from_table * Eigen::Vector3d(table.vertices.col(i));
  }
  return MakeObstacle("table", std::move(table), side, threads);
}

}  // namespace

TakeReport ReachAndTake(const ReachPerson& person, const wandr::NetworkWeights& network,
                        const TakeRequest& request, const PreparedObject& object,
                        ReachOptions options, const StagedProgress& progress) {
  options.side = request.side;
  options.threads = request.threads;
  const auto motions = [&](const TakePlan& plan, int attempt) {
    ReachOptions asked = options;
    asked.seed = request.seed + kOther * static_cast<std::uint64_t>(attempt);
    std::vector<Eigen::Vector3d> wrists;
    for (const TakeGoal& goal : plan.goals) {
      wrists.push_back(goal.wrist);
      asked.stay_frames.push_back(std::max(
          kShortestStay, static_cast<int>(std::lround(wandr::kFramesPerSecond * goal.stay_s))));
    }
    if (asked.by == ReachBy::kLatents) {
      asked.obstacles.push_back(TableOf(plan, asked.side, asked.threads));
    }
    std::vector<TakeBodyMotion> taken;
    const ReachReport made = MakeReachMotions(person, network, wrists, asked, progress);
    for (const ReachMotion& reach : made.motions) {
      const wandr::ReachSample& sample = reach.sample;
      if (sample.diverged || sample.NumReached() < static_cast<int>(wrists.size())) continue;
      TakeBodyMotion motion;
      motion.states = sample.track.states.cast<double>();
      for (const wandr::GoalOutcome& goal : sample.goals) {
        motion.frames.push_back(goal.closest_frame);
      }
      taken.push_back(std::move(motion));
    }
    return taken;
  };
  return TakeFromTable(request, {person.body, person.betas, person.like, person.Pelvis()}, object,
                       motions, progress);
}

void RequireTaken(const TakeReport& report, const std::string& object) {
  switch (report.status) {
    case TakeStatus::kTaken:
    case TakeStatus::kStopped:
      return;
    case TakeStatus::kNoGrasp:
      throw FitFailure(fmt::format("{}: {}. Try the other --wrist, or another --object-scale",
                                   object, Describe(report.plan.status)));
    case TakeStatus::kNoMotion:
      throw FitFailure(fmt::format("{}: {}. Try another --seed, or goals closer to each other",
                                   object, report.motion.fault));
    case TakeStatus::kMissed:
      throw FitFailure(fmt::format(
          "{}: the hand stays {:.0f} cm from the object, which is too far, too high or too low for "
          "this body. Move the first --goal, or try another --seed",
          object, 100.0 * report.motion.take_wrist_error_m));
  }
}

namespace {

nlohmann::json VectorJson(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

nlohmann::json TakenJson(const TakeReport& report) {
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
           {{"top_middle_m", VectorJson(table.world_from_table.translation())},
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
  summary["arm_lacked_before_leaning_m"] = motion.shoulder_shortfall_m;
  summary["carry_arm_lacked_m"] = motion.max_shortfall_m;
  summary["carry_hand_error_deg"] = motion.max_hand_error_rad / kDegree;
  return summary;
}

}  // namespace

nlohmann::json GoalsJson(const wandr::ReachSample& sample, std::span<const Eigen::Vector3d> goals,
                         const std::vector<std::optional<std::string>>& why) {
  nlohmann::json out = nlohmann::json::array();
  const auto frame_or_null = [](int frame) {
    return frame < 0 ? nlohmann::json(nullptr) : nlohmann::json(frame);
  };
  for (std::size_t g = 0; g < goals.size(); ++g) {
    const wandr::GoalOutcome& goal = sample.goals[g];
    out.push_back({{"goal_m", VectorJson(goals[g])},
                   {"reached", goal.Reached()},
                   {"taken_on_frame", frame_or_null(goal.taken_on)},
                   {"due_frame", frame_or_null(goal.due)},
                   {"reached_frame", frame_or_null(goal.reached)},
                   {"left_frame", frame_or_null(goal.left)},
                   {"closest_m", goal.taken_on >= 0 ? nlohmann::json(goal.closest_m) : nullptr},
                   {"closest_frame", frame_or_null(goal.closest_frame)},
                   {"why_missed", why[g] ? nlohmann::json(*why[g]) : nlohmann::json(nullptr)}});
  }
  return out;
}

nlohmann::json MotionJson(const ReachMotion& motion) {
  const ReachQuality& quality = motion.quality;
  nlohmann::json solves = nlohmann::json::array();
  for (const LatentSolve& solve : motion.solves) {
    solves.push_back({{"minimizer", solve.minimizer},
                      {"linear_solver", solve.linear_solver},
                      {"iterations", solve.iterations},
                      {"termination", solve.termination}});
  }
  return {{"sample", motion.index},
          {"frames", motion.sample.track.states.cols()},
          {"goals_reached", motion.sample.NumReached()},
          {"closest_sum_m", quality.closest_sum_m},
          {"foot_skating_ratio", quality.skating},
          {"foot_skating_joints_ratio", quality.joint_skating},
          {"airborne_ratio", quality.airborne},
          {"peak_pelvis_m_s", quality.peak_pelvis_m_s},
          {"motion_cost", motion.cost},
          {"crouches_twice", quality.crouches_twice},
          {"off_balance_mm", std::isnan(quality.off_balance_m)
                                 ? nlohmann::json(nullptr)
                                 : nlohmann::json(1000.0 * quality.off_balance_m)},
          {"diverged", motion.sample.diverged},
          {"latent_solves", solves}};
}

nlohmann::json TakeJson(const TakeReport& report) {
  const TakeMotion& motion = report.motion;
  nlohmann::json json = {
      {"take", TakenJson(report)}, {"summary", TakeSummaryJson(report)}, {"notes", report.notes}};
  nlohmann::json& frames = json["per_frame"];
  frames["object_tilt_deg"] = report.measured.tilt_deg;
  for (int t = 0; t < report.clip.NumFrames(); ++t) {
    frames["arm_lacks_mm"].push_back(1000.0 * motion.shortfall_m[t]);
    frames["hand_error_deg"].push_back(motion.hand_error_rad[t] / kDegree);
  }
  for (const ContactScore::Frame& frame : report.contact.frames) {
    frames["max_penetration_mm"].push_back(frame.penetration_mm);
    frames["min_distance_mm"].push_back(frame.min_distance_mm);
  }
  return json;
}

}  // namespace holdfast
