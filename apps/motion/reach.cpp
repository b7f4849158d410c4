// SPDX-License-Identifier: MIT
#include "apps/motion/reach.h"

#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include "apps/clip_input.h"
#include "apps/common.h"
#include "apps/motion/reach_take.h"
#include "apps/output.h"
#include "geometry/error.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/mesh.h"
#include "geometry/options.h"
#include "solver/reach/reach_and_take.h"
#include "solver/reach/walk_and_reach.h"

namespace holdfast::apps {
namespace {

// Adds the options for a moving goal. Excludes options that plan a whole motion.
void AddTrackOptions(CLI::App& command, CLI::Option& goal, ReachCommand& reach) {
  CLI::Option* track = command
                           .add_option("--track", reach.track,
                                       "Table of a moving goal (x,y,z or time,x,y,z per line): one "
                                       "goal per frame at 30 Hz, followed without looking ahead")
                           ->excludes(&goal);
  command
      .add_option(
          "--rate", reach.rate_hz,
          "Goals per second in the table [from its time column, else 30]; each frame uses the "
          "latest goal")
      ->check(CLI::Range(0.1, 10'000.0))
      ->needs(track);
  command
      .add_option("--push", reach.pushes,
                  "FRAME,DX,DY,DZ: push the body by this displacement in meters, over 0.3 s from "
                  "this frame on. May be repeated")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->needs(track);
}

}  // namespace

void AddReachCommand(CLI::App& app, int& exit_code) {
  struct Options {
    CommonOptions common;
    ReachCommand reach;
  };
  auto options = std::make_shared<Options>();
  ReachCommand& reach = options->reach;
  CLI::App* command =
      app.add_subcommand("reach", "Generate a person who walks to a goal and reaches for it");
  CLI::Option* goal =
      command
          ->add_option("--goal", reach.goals,
                       "X,Y,Z of the wrist, meters, z up from the ground. May be repeated: goals "
                       "are reached one after another in one motion")
          ->expected(1)
          ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  AddTrackOptions(*command, *goal, reach);
  command->add_option("--from", reach.from,
                      "CLIP or CLIP:FRAME to continue from; default frame: the last. Without "
                      "--from, the person stands at the origin, facing -y");
  AddOptions(*command, OptionsOf(reach.job).Without(
                           {"grasp", "refit_all", "object_scale", "object_yaw_deg"}));
  command
      ->add_option("--obstacle", reach.obstacles,
                   "Mesh to avoid, in world coordinates (latent-opt). May be repeated")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  command
      ->add_option("--approach", reach.approach,
                   "Direction X,Y,Z of the forearm, from elbow to wrist, on arrival (latent-opt)")
      ->excludes(command->get_option("--free-time"));
  CLI::Option* object = command->add_option(
      "--object", reach.object,
      "Mesh or embedded object to take: it stands on a table with the center of its base at the "
      "first --goal and is carried to the other goals. Needs --grasp");
  command
      ->add_option(
          "--grasp", reach.grasp,
          "Grasp style for taking the object: power, precision, handle, or auto (the best)")
      ->expected(0, 1)
      ->default_str("auto")
      ->check(CLI::IsMember({"auto", "power", "precision", "handle"}))
      ->needs(object);
  object->needs(command->get_option("--grasp"));
  AddOptions(*command, OptionsOf(reach.job).Only({"object_yaw_deg", "object_scale"}));
  command->get_option("--object-yaw")->needs(object);
  command->get_option("--object-scale")->needs(object);
  command->add_flag("--all", reach.all, "Keep all samples: samples/NN.npz, best first");
  command->add_option("--body", reach.body, "Body model in place of the embedded one");
  AddWeightsOption(*command, reach.weights);
  command->add_flag_callback(
      "--no-report", [&out = reach.write_report] { out = false; }, "Leave out report.html");
  for (const char* planned :
       {"--time", "--method", "--samples", "--obstacle", "--free-time", "--approach", "--no-refit",
        "--object", "--optimizer", "--iterations", "--prior-weight", "--all", "--sigma"}) {
    command->get_option("--track")->excludes(command->get_option(planned));
  }
  AddOption(*command, "-o,--output", reach.output,
            "Output folder: clip.npz, metrics.json, report.html");
  AddCommonOptions(
      *command, options->common, true,
      "  holdfast reach --goal 1.5,1.0,1.1\n"
      "  holdfast reach --goal 0.4,-2.0,0.9 --goal -1.0,-2.5,1.4 --samples 64 -o errand\n"
      "  holdfast reach --goal 3,1,1.2 --method latent-opt -o precise\n"
      "  holdfast reach --from walk.npz:40 --goal 2.0,0.5,0.3 --wrist left --all -o reached\n"
      "  holdfast reach --goal 1.5,1,0.8 --goal -0.5,1.5,1.1 --object mug --grasp -o taken\n"
      "  holdfast reach --track goals.csv --push 90,0.2,0,0 -o followed\n"
      "A goal is reached when the wrist is within 10 cm of it. The next goal becomes current when\n"
      "the wrist has reached a goal and stops approaching it, or at 1.5 times the due time (2 "
      "times\n"
      "while the wrist still approaches). If no sample reaches all goals, sampling is repeated "
      "once\n"
      "with 1.5 times the time. Samples are ranked by:\n"
      "  1. the most goals reached\n"
      "  2. the fewest goals at which the person crouches twice\n"
      "  3. the lowest motion cost (speed, turns, lean, pelvis height, joint limits, "
      "accelerations)\n"
      "     if all goals are reached, else the lowest sum of closest distances\n"
      "If the best sample crouches twice or ends off balance after its feet are pinned, the next\n"
      "is tried; at most six samples are tried.\n");
  command->callback([options, &exit_code] {
    if (options->reach.goals.empty() && options->reach.track.empty()) {
      throw CLI::RequiredError("--goal or --track");
    }
    const Outcome outcome = RunReach(options->reach, options->common);
    if (!outcome.summary.is_null()) PrintResult(options->common, outcome.summary, outcome.text);
    exit_code = outcome.exit_code;
  });
}

namespace {

namespace fs = std::filesystem;

constexpr int kReportedSamples = 6;
constexpr const char* kRule =
    "most goals reached within 10 cm; then no second crouch; then the lowest motion cost if all "
    "goals are reached, else the lowest sum of closest distances; after refitting, of the first "
    "six the first in balance";

// Start of the reach, and the user's name for it.
struct Start {
  std::string source = "standing";
  ReachPerson person;
};

Start StartOf(const ReachCommand& command, const CommonOptions& common) {
  if (command.from.empty()) return {"standing", StandingPerson(LoadBody(command.body))};
  const auto [name, frame] = ParseStart(command.from);
  LoadedClip loaded = LoadClip(name, LoadBody(command.body), common);
  return {name, PersonInClip(std::move(loaded.clip), loaded.body, frame, name)};
}

ReachOptions OptionsFor(const ReachCommand& command, const CommonOptions& common) {
  ReachJob job = command.job;
  job.options.refit_all = command.all;
  job.options.seed = common.seed;
  job.options.threads = NumThreads(common);
  if (!command.approach.empty()) job.approach = ParsePoint("--approach", command.approach);
  job.options.obstacles.resize(command.obstacles.size());  // read after the options are checked
  ReachOptions options = ReachOptionsOf(job, !command.object.empty());
  for (std::size_t i = 0; i < command.obstacles.size(); ++i) {
    const std::string& file = command.obstacles[i];
    options.obstacles[i] = NamingSource("mesh", file, [&] {
      return MakeObstacle(file, ReadMesh(file), options.side, options.threads);
    });
  }
  return options;
}

nlohmann::json OptionsJson(const ReachCommand& command, const Start& start,
                           const ReachOptions& options) {
  nlohmann::json json = {{"goals", command.goals},
                         {"from", start.source},
                         {"from_frame_30fps", start.person.Frame()},
                         {"wrist", SideName(options.side)},
                         {"method", ReachMethodName(options.by)},
                         {"time_s", options.time_s ? nlohmann::json(*options.time_s) : nullptr},
                         {"samples", options.NumSamples()},
                         {"sigma", options.sigma},
                         {"refit", options.refit},
                         {"free_time", options.free_time},
                         {"approach", command.approach},
                         {"obstacles", command.obstacles},
                         {"body", start.person.body->Name()}};
  if (options.by == ReachBy::kVaeOpt) {
    ReachJob job = command.job;
    if (!job.optimizer) job.optimizer = VaeOptMethod::kLm;
    json["vae_opt"] = {{"optimizer", holdfast::OptionsJson(OptionsOf(job))["optimizer"]},
                       {"iterations", options.vae.NumIterations()},
                       {"goal_sigma_m", options.vae.goal_sigma_m},
                       {"prior_weight", options.vae.prior_weight}};
  }
  return json;
}

// Per-frame curves of one sample, for metrics and report.
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

std::string Text(const ReachCommand& command, const ReachOptions& options,
                 const ReachReport& report, std::span<const Eigen::Vector3d> goals) {
  const wandr::ReachSample& best = report.motions.front().sample;
  const ReachQuality& quality = report.motions.front().quality;
  const auto frames = static_cast<double>(best.track.states.cols());
  std::string text = fmt::format(
      "{}/clip.npz: {} of {} goal{} reached with the {} wrist, {:.0f} frames ({:.1f} s)\n",
      command.output, best.NumReached(), goals.size(), goals.size() == 1 ? "" : "s",
      SideName(options.side), frames, frames / wandr::kFramesPerSecond);
  for (std::size_t g = 0; g < goals.size(); ++g) {
    const wandr::GoalOutcome& goal = best.goals[g];
    std::string fate = "not attempted: the motion diverged before";
    if (goal.Reached()) {
      fate = fmt::format("reached after {:.1f} s, closest {:.1f} cm",
                         (goal.reached - goal.taken_on) / wandr::kFramesPerSecond,
                         100.0 * goal.closest_m);
    } else if (goal.taken_on >= 0) {
      fate = fmt::format("missed by {:.0f} cm: {}", 100.0 * goal.closest_m,
                         report.why_missed[g].value_or(""));
    }
    text += fmt::format("  {:<26}{}\n", "goal " + GoalText(goals[g]), fate);
  }
  text += fmt::format("  {:<26}{:.0f} % of frames skate, {:.0f} % in the air\n", "feet",
                      100.0 * quality.skating, 100.0 * quality.airborne);
  text += fmt::format("  {:<26}best of {} with {}; {} reach {}; {:.2f} s\n", "samples",
                      options.NumSamples(), ReachMethodName(options.by), report.reach_all,
                      goals.size() == 1 ? "the goal" : "all goals", report.seconds);
  return text;
}

}  // namespace

Eigen::Vector3d ParsePoint(const std::string& option, const std::string& text) {
  const auto numbers = NumbersFrom(text, 3);
  if (!numbers) {
    throw Error(option + " " + text, "is not three finite numbers",
                "Give X,Y,Z in meters with commas and no spaces, as in 1.5,1.0,1.1");
  }
  const Eigen::Vector3d goal(numbers->data());
  if (goal.cwiseAbs().maxCoeff() > kMaxMeters) {
    throw Error(option + " " + text, fmt::format("is more than {:g} m away", kMaxMeters),
                "Give meters, as in 1.5,1.0,1.1");
  }
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

// Runs the take and the following carries.
Outcome RunTake(const ReachCommand& command, const Start& start, const ReachNetwork& network,
                std::span<const Eigen::Vector3d> goals, const ReachOptions& options,
                const CommonOptions& common) {
  TakeJob take;
  take.object = command.object;
  take.side = options.side;
  take.style = command.grasp;
  take.places.assign(goals.begin(), goals.end());
  take.object_yaw_deg = command.job.object_yaw_deg;
  take.object_scale = command.job.object_scale;
  take.output = command.output;
  take.write_report = command.write_report;
  nlohmann::json extra;
  extra["network"] = NetworkJson(network);
  extra["options"] = OptionsJson(command, start, options);
  return RunReachTake(take, start.person, network.weights, options, extra, common);
}

nlohmann::json MetricsOf(const ReachCommand& command, const Start& start,
                         const ReachNetwork& network, const ReachOptions& options,
                         const ReachReport& report, std::span<const Eigen::Vector3d> goals,
                         const std::vector<std::string>& notes, const CommonOptions& common) {
  const ReachMotion& best = report.motions.front();
  nlohmann::json metrics = JsonHead("holdfast/reach/1", common);
  metrics["options"] = OptionsJson(command, start, options);
  metrics["network"] = NetworkJson(network);
  metrics["chosen_by"] = kRule;
  metrics["chosen"] = best.index;
  metrics["goals"] = GoalsJson(best.sample, goals, report.why_missed);
  metrics["summary"] = MotionJson(best);
  metrics["summary"]["samples_that_reach_all"] = report.reach_all;
  if (best.refit) {
    metrics["refit"] = {{"max_foot_correction_m", best.refit->max_foot_correction_m},
                        {"max_pelvis_sink_m", best.refit->max_pelvis_sink_m},
                        {"max_hand_bend_rad", best.refit->max_hand_bend_rad},
                        {"wrist_errors_m", best.refit->wrist_errors_m}};
  }
  for (const ReachMotion& motion : report.motions) {
    metrics["samples"].push_back(MotionJson(motion));
  }
  metrics["notes"] = notes;
  return metrics;
}

// Report input of the motion with this rank. The best motion has all metrics.
ReportInput Shown(const ReachCommand& command, const ReachPerson& person,
                  const ReachOptions& options, const ReachMotion& motion, int rank,
                  std::span<const Eigen::Vector3d> goals, const nlohmann::json& metrics) {
  const std::string file = rank == 0 ? "clip.npz" : fmt::format("samples/{:02d}.npz", rank);
  ReportInput shown;
  shown.file = fs::path(command.output) / file;
  shown.source = rank == 0 ? command.output : shown.file.string();
  shown.clip = ClipOf(motion, person);
  shown.body = person.body;
  shown.betas = person.betas;
  if (!options.obstacles.empty()) shown.marker.emplace();
  for (const ReachObstacle& obstacle : options.obstacles) Append(obstacle.mesh, *shown.marker);
  if (rank == 0) {
    shown.metrics = metrics;
  } else {
    shown.metrics["goals"] = metrics["goals"];
  }
  shown.metrics["per_frame"] = PerFrameJson(motion.sample, goals, options.side);
  return shown;
}

void WriteResult(const ReachCommand& command, const ReachPerson& person,
                 const ReachOptions& options, const ReachReport& report,
                 std::span<const Eigen::Vector3d> goals, const nlohmann::json& metrics,
                 ResultFolder& folder, const CommonOptions& common) {
  const auto shown_of = [&](int rank) {
    return Shown(command, person, options, report.motions[static_cast<std::size_t>(rank)], rank,
                 goals, metrics);
  };
  std::vector<ReportInput> shown = {shown_of(0)};
  WriteClip(shown[0].clip, folder / "clip.npz");
  shown[0].metrics = folder.WriteMetrics(std::move(shown[0].metrics));
  if (command.all) {
    fs::create_directory(folder / "samples");
    for (int rank = 0; rank < static_cast<int>(report.motions.size()); ++rank) {
      WriteClip(ClipOf(report.motions[static_cast<std::size_t>(rank)], person),
                folder / fmt::format("samples/{:02d}.npz", rank).c_str());
      if (rank > 0 && rank < kReportedSamples) shown.push_back(shown_of(rank));
    }
  }
  if (command.write_report) {
    WriteReportBeside(shown, folder / "report.html", common);
  }
  folder.Commit();
}

}  // namespace

Outcome RunReach(const ReachCommand& command, const CommonOptions& common) {
  const Outcome stopped{kInterrupted, {}, {}};
  if (!command.track.empty()) {
    TrackJob track{command.track,  command.rate_hz,     command.pushes, {},
                   command.output, command.write_report};
    track.follow.side = command.job.options.side;
    track.follow.seed = common.seed;
    const Start start = StartOf(command, common);
    return RunReachTrack(track, start.person, start.source,
                         LoadReachNetwork(command.weights, common), common);
  }
  std::vector<Eigen::Vector3d> goals;
  for (const std::string& text : command.goals) goals.push_back(ParsePoint("--goal", text));
  const ReachNetwork network = LoadReachNetwork(command.weights, common);
  const Start start = StartOf(command, common);
  const ReachOptions options = OptionsFor(command, common);
  const std::vector<std::string> notes = CheckReachGoals(goals, start.person, options);
  for (const std::string& note : notes) Note(common, "warning: " + note);
  if (!command.object.empty()) return RunTake(command, start, network, goals, options, common);

  ResultFolder folder(command.output, common.force);
  StageProgress progress(common);
  const ReachReport report = WalkAndReach(start.person, network.weights, goals, options,
                                          [&](const char* stage, int done, int total) {
                                            progress.Update(stage, done, total);
                                            return !Interrupted();
                                          });
  progress.End();
  if (report.stopped) return stopped;
  RequireMade(report, network.source);
  nlohmann::json metrics =
      MetricsOf(command, start, network, options, report, goals, notes, common);
  WriteResult(command, start.person, options, report, goals, metrics, folder, common);
  Outcome outcome;
  outcome.exit_code = Interrupted() ? kInterrupted : kDone;
  outcome.text = Text(command, options, report, goals);
  outcome.summary = std::move(metrics);
  outcome.summary["output"] = command.output;
  return outcome;
}

}  // namespace holdfast::apps
