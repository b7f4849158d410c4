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
#include "apps/reach_network.h"
#include "apps/report.h"
#include "apps/result_folder.h"
#include "generator/reach_motion.h"
#include "generator/wandr/motion_states.h"
#include "generator/wandr/reach_goals.h"
#include "generator/wandr/reach_outcome.h"
#include "generator/wandr/reach_skating.h"
#include "geometry/error.h"
#include "geometry/io/atomic_file.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

constexpr double kFarthest = 20.0;      // metres: nobody has been shown walking so far
constexpr double kUsualDistance = 5.0;  // metres: as far as networks are trained and evaluated
constexpr double kFastestWalk = 2.0;    // m/s
constexpr double kMarkerRadius = 0.04;  // metres
constexpr int kReportedSamples = 6;
constexpr const char* kRule =
    "most goals reached within 10 cm; then, of those that reach all, the least share of frames "
    "that skate or fly, of others the least sum of closest distances";

struct Stopped {};

// Where the motion starts, and on whose body.
struct Beginning {
  std::string source;
  int frame = 0;  // at 30 fps
  Clip like;      // body, betas and subject of the clip made
  std::shared_ptr<const BodyModel> body;
  Eigen::VectorXd betas;
  wandr::BoneOffsets<double> bones;
  double sole_y = 0.0;
  Eigen::Matrix3Xd rest_joints;
  wandr::StateMatrix<double> states;  // up to the frame
};

Beginning Begin(const ReachJob& job, const CommonOptions& common) {
  Beginning begin;
  std::optional<int> frame;
  if (job.from.empty()) {
    begin.source = "standing";
    begin.body = LoadBody(job.body);
    begin.like.body_model = begin.body->Name();
  } else {
    std::string name;
    std::tie(name, frame) = ParseStart(job.from);
    ClipInputOptions input_options;
    input_options.body = job.body;
    ClipInput input = LoadClipInput(name, input_options, common);
    begin.source = name;
    begin.body = input.body;
    begin.betas = input.betas;
    const int frames = input.clip.NumFrames();
    if (frame && *frame >= frames) {
      throw Error(job.from, fmt::format("the clip has frames 0 to {}", frames - 1),
                  "Give one of those");
    }
    begin.states = wandr::StatesOfClip(input.clip);
    const double rate = wandr::kFramesPerSecond / input.clip.frame_rate;
    begin.frame = std::min(static_cast<int>(std::lround(frame.value_or(frames - 1) * rate)),
                           static_cast<int>(begin.states.cols()) - 1);
    begin.states.conservativeResize(Eigen::NoChange, begin.frame + 1);
    begin.like = std::move(input.clip);
  }
  if (begin.body->LoneHand()) {
    throw Error(begin.body->Name(), "is a hand alone: it cannot walk", "Give a whole body");
  }
  const BodyMeasures measures = MeasureBody(*begin.body, begin.betas);
  begin.rest_joints = measures.rest_joints;
  begin.sole_y = measures.sole_y;
  begin.bones = wandr::BoneOffsetsOf(measures.rest_joints);
  if (job.from.empty()) begin.states = wandr::StateOf(wandr::StandingPose(measures));
  return begin;
}

// Highest place that the body's wrist comes to with both soles on the ground.
double HighestReach(const Beginning& begin, Side side) {
  const int wrist = WristJoint(side), elbow = kJointParents[wrist], shoulder = kJointParents[elbow];
  return begin.rest_joints(1, shoulder) - begin.sole_y + begin.bones.offset.col(elbow).norm() +
         begin.bones.offset.col(wrist).norm();
}

std::string GoalText(const Eigen::Vector3d& goal) {
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", goal.x(), goal.y(), goal.z());
}

// Says what cannot be done, and throws Error where there is no sense in trying.
std::vector<std::string> CheckGoals(std::span<const Eigen::Vector3d> goals, const Beginning& begin,
                                    const ReachJob& job, Side side) {
  std::vector<std::string> notes;
  const wandr::Pose<double> pose = wandr::PoseOf<double>(begin.states.rightCols<1>());
  const double pelvis_height = begin.rest_joints(1, 0) - begin.sole_y;
  Eigen::Vector3d from = pose.translation + begin.bones.offset.col(0);
  if (from.z() > pelvis_height + 0.25 || from.z() < 0.0) {
    notes.push_back(fmt::format(
        "the start's pelvis is {:.2f} m above z = 0, {:.2f} m is standing: motions are made for a "
        "ground at z = 0",
        from.z(), pelvis_height));
  }
  const double highest = HighestReach(begin, side);
  for (const Eigen::Vector3d& goal : goals) {
    const double distance = (goal - from).head<2>().norm();
    if (goal.z() < 0.0) {
      throw Error("--goal " + GoalText(goal),
                  fmt::format("is {:.2f} m below the ground z = 0", -goal.z()),
                  "Give a height of 0 or more: x and y are on the ground, z is up, metres");
    }
    if (distance > kFarthest) {
      throw Error(
          "--goal " + GoalText(goal),
          fmt::format("is {:.1f} m away; {:.0f} m is the most that is tried", distance, kFarthest),
          "Give metres, or go there by several goals (--goal again and again)");
    }
    if (distance > kUsualDistance) {
      notes.push_back(fmt::format(
          "the goal {} is {:.1f} m away; networks are trained and evaluated up to {:.0f} m: the "
          "body walks towards it for as long as that takes, and may not arrive",
          GoalText(goal), distance, kUsualDistance));
    }
    if (goal.z() > highest) {
      notes.push_back(fmt::format(
          "the goal {} is higher than the {:.2f} m that this body's wrist comes to on the ground: "
          "it will come as near as it can",
          GoalText(goal), highest));
    }
    if (job.time_s && distance / *job.time_s > kFastestWalk) {
      notes.push_back(fmt::format(
          "{:.1f} s for {:.1f} m is faster than a walk: the goal {} will be late or missed",
          *job.time_s, distance, GoalText(goal)));
    }
    from = goal;
  }
  return notes;
}

struct Measured {
  double skating = 0.0;        // FS on the surface
  double joint_skating = 0.0;  // FS by foot joints
  double airborne = 0.0;
  double closest_sum = 0.0;
  double peak_pelvis_m_s = 0.0;
};

Measured Measure(const wandr::ReachSample& sample, const wandr::LowestPoint& lowest,
                 std::span<const Eigen::Vector3d> goals) {
  const wandr::ReachOutcome outcome = wandr::MeasureReach(sample.track.joints, goals.back());
  Measured measured;
  measured.skating = wandr::SkatingOfLowestVertex(lowest, sample.track.states);
  measured.joint_skating = outcome.skating_share;
  measured.airborne = outcome.airborne_share;
  measured.peak_pelvis_m_s = outcome.peak_pelvis_m_s;
  // A goal that was never taken on is as far as the wrist was from it at the end.
  for (std::size_t g = 0; g < goals.size(); ++g) {
    const Eigen::Vector3d last =
        sample.track.joints.block<3, 1>(63, sample.track.joints.cols() - 1).cast<double>();
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

// A ball of 12 x 8 facets at each goal.
TriangleMesh Markers(std::span<const Eigen::Vector3d> goals) {
  constexpr int kAround = 12, kRings = 7;
  constexpr int kVertices = kAround * kRings + 2, kFaces = 2 * kAround * kRings;
  const auto count = static_cast<Eigen::Index>(goals.size());
  TriangleMesh mesh;
  mesh.vertices.resize(3, kVertices * count);
  mesh.faces.resize(3, kFaces * count);
  for (Eigen::Index g = 0; g < count; ++g) {
    const Eigen::Vector3d& centre = goals[static_cast<std::size_t>(g)];
    const auto first = static_cast<int>(kVertices * g);
    int face = static_cast<int>(kFaces * g);
    for (int r = 0; r < kRings; ++r) {
      const double polar = std::numbers::pi * (r + 1) / (kRings + 1);
      for (int a = 0; a < kAround; ++a) {
        const double azimuth = 2.0 * std::numbers::pi * a / kAround;
        mesh.vertices.col(first + kAround * r + a) =
            centre + kMarkerRadius * Eigen::Vector3d(std::sin(polar) * std::cos(azimuth),
                                                     std::sin(polar) * std::sin(azimuth),
                                                     std::cos(polar));
        const int here = first + kAround * r + a, next = first + kAround * r + (a + 1) % kAround;
        if (r + 1 == kRings) continue;
        mesh.faces.col(face++) << here, here + kAround, next;
        mesh.faces.col(face++) << next, here + kAround, next + kAround;
      }
    }
    const int top = first + kVertices - 2, bottom = first + kVertices - 1;
    mesh.vertices.col(top) = centre + Eigen::Vector3d(0.0, 0.0, kMarkerRadius);
    mesh.vertices.col(bottom) = centre - Eigen::Vector3d(0.0, 0.0, kMarkerRadius);
    for (int a = 0; a < kAround; ++a) {
      const int b = (a + 1) % kAround, ring = first + kAround * (kRings - 1);
      mesh.faces.col(face++) << top, first + a, first + b;
      mesh.faces.col(face++) << bottom, ring + b, ring + a;
    }
  }
  return mesh;
}

nlohmann::json GoalsJson(const wandr::ReachSample& sample, std::span<const Eigen::Vector3d> goals) {
  nlohmann::json json = nlohmann::json::array();
  const auto frame_or_null = [](int frame) {
    return frame < 0 ? nlohmann::json(nullptr) : nlohmann::json(frame);
  };
  for (std::size_t g = 0; g < goals.size(); ++g) {
    const wandr::GoalOutcome& goal = sample.goals[g];
    const bool tried = goal.taken_on >= 0;
    json.push_back({{"goal_m", {goals[g].x(), goals[g].y(), goals[g].z()}},
                    {"reached", goal.Reached()},
                    {"taken_on_frame", frame_or_null(goal.taken_on)},
                    {"due_frame", frame_or_null(goal.due)},
                    {"reached_frame", frame_or_null(goal.reached)},
                    {"left_frame", frame_or_null(goal.left)},
                    {"closest_m", tried ? nlohmann::json(goal.closest_m) : nullptr},
                    {"closest_frame", frame_or_null(goal.closest_frame)}});
  }
  return json;
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
                            std::span<const Eigen::Vector3d> goals) {
  nlohmann::json distance = nlohmann::json::array();
  for (Eigen::Index f = 0; f < sample.track.joints.cols(); ++f) {
    const Eigen::Vector3d wrist =
        sample.track.joints.block<3, 1>(3 * WristJoint(Side::kRight), f).cast<double>();
    distance.push_back((wrist - goals[sample.goal_of_frame[f]]).norm());
  }
  nlohmann::json curves = {{"goal_distance_m", distance}};
  if (goals.size() > 1) curves["goal_index"] = sample.goal_of_frame;
  return curves;
}

std::string Text(const ReachJob& job, const wandr::ReachSample& best, const Measured& measured,
                 std::span<const Eigen::Vector3d> goals, int full, double seconds) {
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
      fate = fmt::format("missed by {:.0f} cm", 100.0 * goal.closest_m);
    }
    text += fmt::format("  {:<26}{}\n", "goal " + GoalText(goals[g]), fate);
  }
  text += fmt::format("  {:<26}{:.0f} % of frames skate, {:.0f} % in the air\n", "feet",
                      100.0 * measured.skating, 100.0 * measured.airborne);
  text += fmt::format("  {:<26}best of {}; {} reach {}; {:.2f} s\n", "samples", job.samples, full,
                      goals.size() == 1 ? "the goal" : "all goals", seconds);
  return text;
}

}  // namespace

Eigen::Vector3d ParseGoal(const std::string& text) {
  const Error fault("--goal " + text, "is not three finite numbers",
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

FitOutcome RunReachJob(const ReachJob& job, const CommonOptions& common) {
  ResultFolder folder(job.output, common.force);
  std::vector<Eigen::Vector3d> goals;
  for (const std::string& text : job.goals) goals.push_back(ParseGoal(text));
  const Side side = job.wrist == "left" ? Side::kLeft : Side::kRight;
  const bool mirrored = side == Side::kLeft;
  const ReachNetwork network = LoadReachNetwork(job.weights);
  const Beginning begin = Begin(job, common);
  const std::vector<std::string> notes = CheckGoals(goals, begin, job, side);
  for (const std::string& note : notes) Note(common, "warning: " + note);

  // The network reaches with the right wrist: for the left one all happens in the mirror.
  std::vector<Eigen::Vector3d> network_goals = goals;
  if (mirrored) std::ranges::transform(goals, network_goals.begin(), wandr::MirroredPoint);
  const wandr::BoneOffsets<double> bones =
      mirrored ? wandr::MirroredBones(begin.bones) : begin.bones;
  const wandr::StateMatrix<double> states =
      mirrored ? wandr::MirroredStates(begin.states) : begin.states;
  const wandr::Network<float> runnable(network.weights);
  const wandr::RolloutStart<float> start =
      wandr::StartAtFrame(states, begin.frame,
                          wandr::Normaliser<double>(network.weights.statistics))
          .Cast<float>();
  wandr::ReachGoalsOptions options;
  options.seed = common.seed;
  options.sigma = job.sigma;
  if (job.time_s) {
    options.frames = std::max(1, static_cast<int>(std::lround(30.0 * *job.time_s)));
  }
  const auto started = std::chrono::steady_clock::now();
  std::vector<wandr::ReachSample> samples;
  try {
    Progress progress(common, "reach");
    samples = wandr::ReachGoals(runnable, bones.Cast<float>(), start, network_goals, job.samples,
                                NumThreads(common), options, [&](int done, int total) {
                                  if (Interrupted()) throw Stopped();
                                  progress.Update(done, total);
                                });
  } catch (const Stopped&) {
    return {kInterrupted, {}, {}};
  }
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();

  // Feet are measured on the surface of the body that moved: mirrored back first.
  const wandr::LowestPoint lowest(BodySurface(begin.body, begin.betas));
  std::vector<Measured> measured;
  for (wandr::ReachSample& sample : samples) {
    if (mirrored) {
      sample.track.states = wandr::MirroredStates(sample.track.states.cast<double>()).cast<float>();
    }
    measured.push_back(Measure(sample, lowest, network_goals));
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

  nlohmann::json metrics = JsonHead("holdfast/reach/1", common);
  metrics["options"] = {{"goals", job.goals},
                        {"from", begin.source},
                        {"from_frame_30fps", begin.frame},
                        {"wrist", job.wrist},
                        {"time_s", job.time_s ? nlohmann::json(*job.time_s) : nullptr},
                        {"samples", job.samples},
                        {"sigma", job.sigma},
                        {"body", begin.body->Name()}};
  metrics["network"] = network.ToJson();
  metrics["chosen_by"] = kRule;
  metrics["chosen"] = order[0];
  metrics["goals"] = GoalsJson(best, goals);
  metrics["summary"] = SampleJson(best, measured[order[0]], order[0]);
  metrics["summary"]["samples_that_reach_all"] = full;
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
    shown.marker = Markers(goals);
    if (rank == 0) shown.metrics = metrics;
    shown.metrics["per_frame"] = PerFrameJson(sample, network_goals);
    return shown;
  };
  std::vector<ClipInput> shown = {shown_of(0)};
  WriteClip(shown[0].clip, folder / "clip.npz");
  WriteAtomically(folder / "metrics.json", shown[0].metrics.dump(1) + "\n");
  if (job.all) {
    fs::create_directory(folder / "samples");
    for (int rank = 0; rank < job.samples; ++rank) {
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
  outcome.text = Text(job, best, measured[order[0]], goals, static_cast<int>(full), seconds);
  outcome.summary = std::move(metrics);
  outcome.summary["output"] = job.output;
  return outcome;
}

}  // namespace holdfast::apps
