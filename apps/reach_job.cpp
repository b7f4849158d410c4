// SPDX-License-Identifier: MIT
#include "apps/reach_job.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <numbers>
#include <tuple>

#include <fmt/format.h>

#include "apps/clip_input.h"
#include "apps/reach_begin.h"
#include "apps/reach_markers.h"
#include "apps/reach_motions.h"
#include "apps/reach_network.h"
#include "apps/reach_take.h"
#include "apps/report.h"
#include "apps/result_folder.h"
#include "generator/scripted/reach_motion.h"
#include "generator/wandr/motion_states.h"
#include "generator/wandr/reach_goals.h"
#include "generator/wandr/reach_outcome.h"
#include "generator/wandr/reach_skating.h"
#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/parallel.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

constexpr int kReportedSamples = 6;
constexpr const char* kRule =
    "most goals reached within 10 cm; then, of those that reach all, the least share of frames "
    "that skate or fly, of others the least sum of closest distances";

struct Measured {
  double skating = 0.0;        // FS on the surface
  double joint_skating = 0.0;  // FS by foot joints
  double airborne = 0.0;
  double closest_sum = 0.0;
  double peak_pelvis_m_s = 0.0;
};

Measured Measure(const wandr::ReachSample& sample, const wandr::LowestPoint& lowest,
                 std::span<const Eigen::Vector3d> goals, Side side) {
  const wandr::ReachOutcome outcome = wandr::MeasureReach(sample.track.joints, goals.back(), side);
  Measured measured;
  measured.skating = wandr::SkatingOfLowestVertex(lowest, sample.track.states);
  measured.joint_skating = outcome.skating_share;
  measured.airborne = outcome.airborne_share;
  measured.peak_pelvis_m_s = outcome.peak_pelvis_m_s;
  // A goal that was never taken on is as far as the wrist was from it at the end.
  for (std::size_t g = 0; g < goals.size(); ++g) {
    const Eigen::Vector3d last =
        sample.track.joints.block<3, 1>(3 * WristJoint(side), sample.track.joints.cols() - 1)
            .cast<double>();
    measured.closest_sum +=
        sample.goals[g].taken_on >= 0 ? sample.goals[g].closest_m : (goals[g] - last).norm();
  }
  return measured;
}

std::vector<int> Ranked(const std::vector<wandr::ReachSample>& samples,
                        const std::vector<Measured>& measured, int num_goals) {
  std::vector<int> order(samples.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<int>(i);
  const auto key = [&](int i) {
    const int reached = samples[i].NumReached();
    const Measured& m = measured[i];
    return std::tuple(samples[i].diverged, -reached,
                      reached == num_goals ? m.skating + m.airborne : m.closest_sum, i);
  };
  std::ranges::sort(order, [&](int a, int b) { return key(a) < key(b); });
  return order;
}

nlohmann::json OptionsJson(const ReachJob& job, const Beginning& begin) {
  return {{"goals", job.goals},
          {"from", begin.source},
          {"from_frame_30fps", begin.frame},
          {"wrist", job.wrist},
          {"method", job.Method()},
          {"time_s", job.time_s ? nlohmann::json(*job.time_s) : nullptr},
          {"samples", job.NumSamples()},
          {"sigma", job.sigma},
          {"refit", job.refit},
          {"free_time", job.free_time},
          {"approach", job.approach},
          {"obstacles", job.obstacles},
          {"body", begin.body->Name()}};
}

// As the obstacles' distances see it: mirrored where the left wrist reaches.
Eigen::Vector3d Seen(const Eigen::Vector3d& goal, Side side) {
  return side == Side::kLeft ? wandr::MirroredPoint(goal) : goal;
}

void CheckFree(std::span<const Eigen::Vector3d> goals, std::span<const ReachObstacle> obstacles,
               Side side) {
  for (const ReachObstacle& obstacle : obstacles) {
    for (const Eigen::Vector3d& goal : goals) {
      const double distance = obstacle.distance->Distance(Seen(goal, side));
      if (distance >= 0.0) continue;
      throw Error("--goal " + GoalText(goal),
                  fmt::format("is {:.2f} m inside the obstacle {}", -distance, obstacle.name),
                  "Give a goal outside, or leave the obstacle out");
    }
  }
}

// For each goal that was missed; empty where it was not.
std::vector<std::string> WhyMissedAll(const wandr::ReachSample& sample,
                                      std::span<const Eigen::Vector3d> goals,
                                      const Beginning& begin, const ReachJob& job, Side side,
                                      const ReachWishes& wishes) {
  constexpr double kHand = 0.03;  // metres that a wrist is thick
  std::vector<std::string> why(goals.size());
  for (std::size_t g = 0; g < goals.size(); ++g) {
    const wandr::GoalOutcome& goal = sample.goals[g];
    if (goal.taken_on < 0 || goal.Reached()) continue;
    const bool blocked = std::ranges::any_of(wishes.obstacles, [&](const ReachObstacle& obstacle) {
      return obstacle.distance->Distance(Seen(goals[g], side)) < kHand;
    });
    const Eigen::Vector3d from = sample.track.joints.block<3, 1>(0, goal.taken_on).cast<double>();
    why[g] = WhyMissed(goals[g], from, begin, job, side, blocked);
  }
  return why;
}

nlohmann::json GoalsJson(const wandr::ReachSample& sample, std::span<const Eigen::Vector3d> goals,
                         std::span<const std::string> why) {
  nlohmann::json out = nlohmann::json::array();
  const auto frame_or_null = [](int frame) {
    return frame < 0 ? nlohmann::json(nullptr) : nlohmann::json(frame);
  };
  for (std::size_t g = 0; g < goals.size(); ++g) {
    const wandr::GoalOutcome& goal = sample.goals[g];
    const bool tried = goal.taken_on >= 0;
    out.push_back(
        {{"goal_m", {goals[g].x(), goals[g].y(), goals[g].z()}},
         {"reached", goal.Reached()},
         {"taken_on_frame", frame_or_null(goal.taken_on)},
         {"due_frame", frame_or_null(goal.due)},
         {"reached_frame", frame_or_null(goal.reached)},
         {"left_frame", frame_or_null(goal.left)},
         {"closest_m", tried ? nlohmann::json(goal.closest_m) : nullptr},
         {"closest_frame", frame_or_null(goal.closest_frame)},
         {"why_missed", why[g].empty() ? nlohmann::json(nullptr) : nlohmann::json(why[g])}});
  }
  return out;
}

nlohmann::json SampleJson(const wandr::ReachSample& sample, const Measured& measured, int index) {
  return {{"sample", index},
          {"frames", sample.track.states.cols()},
          {"goals_reached", sample.NumReached()},
          {"closest_sum_m", measured.closest_sum},
          {"foot_skating_ratio", measured.skating},
          {"foot_skating_joints_ratio", measured.joint_skating},
          {"airborne_ratio", measured.airborne},
          {"peak_pelvis_m_s", measured.peak_pelvis_m_s},
          {"diverged", sample.diverged}};
}

// Curves of one sample, for metrics and report.
nlohmann::json PerFrameJson(const wandr::ReachSample& sample,
                            std::span<const Eigen::Vector3d> goals, Side side) {
  nlohmann::json distance = nlohmann::json::array();
  for (Eigen::Index f = 0; f < sample.track.joints.cols(); ++f) {
    const Eigen::Vector3d wrist =
        sample.track.joints.block<3, 1>(3 * WristJoint(side), f).cast<double>();
    distance.push_back((wrist - goals[sample.goal_of_frame[f]]).norm());
  }
  nlohmann::json curves = {{"goal_distance_m", distance}};
  if (goals.size() > 1) curves["goal_index"] = sample.goal_of_frame;
  return curves;
}

std::string Text(const ReachJob& job, const wandr::ReachSample& best, const Measured& measured,
                 std::span<const Eigen::Vector3d> goals, std::span<const std::string> why, int full,
                 double seconds) {
  const auto frames = static_cast<double>(best.track.states.cols());
  std::string text = fmt::format(
      "{}/clip.npz: {} of {} goal{} reached with the {} wrist, {:.0f} frames ({:.1f} s)\n",
      job.output, best.NumReached(), goals.size(), goals.size() == 1 ? "" : "s", job.wrist, frames,
      frames / wandr::kFramesPerSecond);
  for (std::size_t g = 0; g < goals.size(); ++g) {
    const wandr::GoalOutcome& goal = best.goals[g];
    std::string fate = "never taken on: the motion broke before";
    if (goal.Reached()) {
      fate = fmt::format("reached after {:.1f} s, closest {:.1f} cm",
                         (goal.reached - goal.taken_on) / wandr::kFramesPerSecond,
                         100.0 * goal.closest_m);
    } else if (goal.taken_on >= 0) {
      fate = fmt::format("missed by {:.0f} cm: {}", 100.0 * goal.closest_m, why[g]);
    }
    text += fmt::format("  {:<26}{}\n", "goal " + GoalText(goals[g]), fate);
  }
  text += fmt::format("  {:<26}{:.0f} % of frames skate, {:.0f} % in the air\n", "feet",
                      100.0 * measured.skating, 100.0 * measured.airborne);
  text +=
      fmt::format("  {:<26}best of {} by {}; {} reach {}; {:.2f} s\n", "samples", job.NumSamples(),
                  job.Method(), full, goals.size() == 1 ? "the goal" : "all goals", seconds);
  return text;
}

}  // namespace

Eigen::Vector3d ParsePoint(const std::string& option, const std::string& text) {
  const Error fault(option + " " + text, "is not three finite numbers",
                    "Give X,Y,Z in metres with commas and no spaces, as in 1.5,1.0,1.1");
  Eigen::Vector3d goal;
  const char* at = text.data();
  const char* const end = text.data() + text.size();
  for (int k = 0; k < 3; ++k) {
    const auto [stopped, error] = std::from_chars(at, end, goal[k]);
    if (error != std::errc() || (k < 2 && (stopped == end || *stopped != ','))) throw fault;
    at = stopped + (k < 2 ? 1 : 0);
  }
  if (at != end || !goal.allFinite()) throw fault;
  return goal;
}

std::pair<std::string, std::optional<int>> ParseStart(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  std::error_code ignored;
  if (colon == std::string::npos || fs::exists(text, ignored)) return {text, std::nullopt};
  int frame = 0;
  const char* const end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(text.data() + colon + 1, end, frame);
  if (error != std::errc() || stopped != end || frame < 0) {
    throw Error("--from " + text, "has no frame number after the colon",
                "Give CLIP or CLIP:FRAME, frames counted from 0");
  }
  return {text.substr(0, colon), frame};
}

namespace {

// The take and the carries after it: reach_take.h does all but the body's motion.
FitOutcome RunTake(const ReachJob& job, const Beginning& begin, const ReachNetwork& network,
                   std::span<const Eigen::Vector3d> goals, Side side, const CommonOptions& common) {
  TakeJob take;
  take.object = job.object;
  take.side = side;
  take.style = job.style;
  take.places.assign(goals.begin(), goals.end());
  take.object_yaw_deg = job.object_yaw_deg;
  take.output = job.output;
  take.write_report = job.write_report;
  const ReachMaker maker(job, begin, network, common);
  const auto motions = [&](const TakePlan& plan, int attempt) {
    std::vector<Eigen::Vector3d> wrists;
    ReachWishes wishes;
    for (const TakeGoal& goal : plan.goals) {
      wrists.push_back(goal.wrist);
      wishes.stay_frames.push_back(
          std::max(12, static_cast<int>(std::lround(wandr::kFramesPerSecond * goal.stay_s))));
    }
    wishes.seed_offset = static_cast<std::uint64_t>(attempt);
    if (job.Method() == "latent-opt") {
      TriangleMesh table = plan.table.Mesh();
      for (Eigen::Index i = 0; i < table.vertices.cols(); ++i) {
        table.vertices.col(i) =
            plan.table.world_from_table * Eigen::Vector3d(table.vertices.col(i));
      }
      wishes.obstacles.push_back(MakeObstacle("table", std::move(table), side, NumThreads(common)));
    }
    std::vector<TakenMotion> taken;
    const ReachMotions made = maker.Make(wrists, wishes);
    for (const wandr::ReachSample& sample : made.samples) {
      if (sample.diverged || sample.NumReached() < static_cast<int>(wrists.size())) continue;
      TakenMotion motion;
      motion.states = sample.track.states.cast<double>();
      for (const wandr::GoalOutcome& goal : sample.goals)
        motion.frames.push_back(goal.closest_frame);
      taken.push_back(std::move(motion));
    }
    return taken;
  };
  nlohmann::json extra;
  extra["network"] = network.ToJson();
  extra["options"] = OptionsJson(job, begin);
  return RunReachTake(take, {begin.body, begin.betas, begin.like, begin.Pelvis()}, motions, extra,
                      common);
}

}  // namespace

FitOutcome RunReachJob(const ReachJob& job, const CommonOptions& common) {
  std::vector<Eigen::Vector3d> goals;
  for (const std::string& text : job.goals) goals.push_back(ParsePoint("--goal", text));
  const Side side = job.wrist == "left" ? Side::kLeft : Side::kRight;
  const ReachNetwork network = LoadReachNetwork(job.weights);
  const Beginning begin = BeginReach(job, common);
  const std::vector<std::string> notes = CheckGoals(goals, begin, job, side);
  for (const std::string& note : notes) Note(common, "warning: " + note);
  if (!job.object.empty()) return RunTake(job, begin, network, goals, side, common);

  if (!job.obstacles.empty() && job.Method() != "latent-opt") {
    throw Error("--obstacle", "is not seen by --method " + job.Method(), "Add --method latent-opt");
  }
  ResultFolder folder(job.output, common.force);
  ReachWishes wishes;
  for (const std::string& file : job.obstacles) {
    wishes.obstacles.push_back(NamingMesh(
        file, [&] { return MakeObstacle(file, ReadMesh(file), side, NumThreads(common)); }));
  }
  CheckFree(goals, wishes.obstacles, side);
  const ReachMaker maker(job, begin, network, common);
  ReachMotions made = maker.Make(goals, wishes);
  if (made.stopped) return {kInterrupted, {}, {}};
  std::vector<wandr::ReachSample>& samples = made.samples;
  const int num_samples = static_cast<int>(samples.size());

  const wandr::LowestPoint lowest(BodySurface(begin.body, begin.betas));
  std::vector<Measured> measured;
  for (const wandr::ReachSample& sample : samples) {
    measured.push_back(Measure(sample, lowest, goals, side));
  }
  const std::vector<int> order = Ranked(samples, measured, static_cast<int>(goals.size()));
  const wandr::ReachSample& best = samples[order[0]];
  if (best.diverged) {
    throw FitFailure(
        fmt::format("{}: the motion stops being numbers in every sample (after {} "
                    "frames in the best). Try another --weights",
                    network.source, best.track.states.cols()));
  }
  const auto full = std::ranges::count_if(samples, [&](const wandr::ReachSample& sample) {
    return !sample.diverged && sample.NumReached() == static_cast<int>(goals.size());
  });
  std::optional<RefitReport> refit;
  if (job.refit && job.Method() == "latent-opt") refit = made.refits[order[0]];
  if (job.refit && job.Method() == "intention") {
    // Chosen as the network made them: only what is written is worth the time.
    std::vector<int> written = order;
    if (!job.all) written.resize(1);
    std::vector<RefitReport> refits(written.size());
    ParallelFor(static_cast<int>(written.size()), NumThreads(common), [&](int k) {
      wandr::ReachSample& sample = samples[written[k]];
      if (sample.diverged) return;
      refits[k] = maker.Refit(goals, sample);
      measured[written[k]] = Measure(sample, lowest, goals, side);
    });
    refit = refits[0];
  }
  const std::vector<std::string> why = WhyMissedAll(best, goals, begin, job, side, wishes);

  nlohmann::json metrics = JsonHead("holdfast/reach/1", common);
  metrics["options"] = OptionsJson(job, begin);
  metrics["network"] = network.ToJson();
  metrics["chosen_by"] = kRule;
  metrics["chosen"] = order[0];
  metrics["goals"] = GoalsJson(best, goals, why);
  metrics["summary"] = SampleJson(best, measured[order[0]], order[0]);
  metrics["summary"]["samples_that_reach_all"] = full;
  if (refit) {
    metrics["refit"] = {{"max_foot_correction_m", refit->max_foot_correction_m},
                        {"max_pelvis_sink_m", refit->max_pelvis_sink_m},
                        {"max_hand_bend_rad", refit->max_hand_bend_rad},
                        {"wrist_errors_m", refit->wrist_errors_m}};
  }
  for (const int i : order) metrics["samples"].push_back(SampleJson(samples[i], measured[i], i));
  metrics["notes"] = notes;

  const auto clip_of = [&](const wandr::ReachSample& sample) {
    Clip clip = wandr::ClipOfStates(sample.track.states.cast<double>(), begin.like);
    clip.action = "reach";
    return clip;
  };
  const auto shown_of = [&](int rank) {
    const wandr::ReachSample& sample = samples[order[rank]];
    ClipInput shown;
    shown.source = rank == 0 ? job.output : fmt::format("{}/samples/{:02d}.npz", job.output, rank);
    shown.file =
        fs::path(job.output) / (rank == 0 ? "clip.npz" : fmt::format("samples/{:02d}.npz", rank));
    shown.clip = clip_of(sample);
    shown.body = begin.body;
    shown.betas = begin.betas;
    shown.marker = GoalMarkers(goals);
    for (const ReachObstacle& obstacle : wishes.obstacles) Append(obstacle.mesh, *shown.marker);
    if (rank == 0) shown.metrics = metrics;
    shown.metrics["per_frame"] = PerFrameJson(sample, goals, side);
    return shown;
  };
  std::vector<ClipInput> shown = {shown_of(0)};
  WriteClip(shown[0].clip, folder / "clip.npz");
  WriteAtomically(folder / "metrics.json", shown[0].metrics.dump(1) + "\n");
  if (job.all) {
    fs::create_directory(folder / "samples");
    for (int rank = 0; rank < num_samples; ++rank) {
      WriteClip(clip_of(samples[order[rank]]),
                folder / fmt::format("samples/{:02d}.npz", rank).c_str());
      if (rank > 0 && rank < kReportedSamples) shown.push_back(shown_of(rank));
    }
  }
  if (job.write_report) {
    WriteReportBeside(shown, folder / "report.html", common);
    if (Interrupted()) return {kInterrupted, {}, {}};
  }
  folder.Commit();

  FitOutcome outcome;
  outcome.exit_code = kDone;
  outcome.text =
      Text(job, best, measured[order[0]], goals, why, static_cast<int>(full), made.seconds);
  outcome.summary = std::move(metrics);
  outcome.summary["output"] = job.output;
  return outcome;
}

}  // namespace holdfast::apps
