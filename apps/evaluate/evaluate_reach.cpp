// SPDX-License-Identifier: MIT
#include "apps/evaluate/evaluate_reach.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <memory>

#include <fmt/format.h>

#include "apps/evaluate/evaluate_track.h"
#include "apps/evaluate/reach_study_output.h"
#include "apps/evaluate/reach_study_page.h"
#include "apps/output.h"
#include "apps/reach_network.h"
#include "geometry/error.h"
#include "solver/evaluation/captured_reaches.h"
#include "solver/evaluation/reach_methods.h"
#include "solver/evaluation/reach_study.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

std::map<std::string, ReachNetwork> AblationNetworks(const std::vector<std::string>& told,
                                                     const CommonOptions& common) {
  std::map<std::string, ReachNetwork> networks;
  for (const std::string& text : told) {
    const std::size_t equals = text.find('=');
    const std::string name = text.substr(0, equals);
    const bool known = std::ranges::any_of(ReachVariants(), [&](const ReachVariant& variant) {
      return variant.key == name && name != "full";
    });
    if (equals == std::string::npos || !known) {
      throw Error("--ablation-weights " + text, "names no ablation",
                  "Give NAME=FILE, NAME one of wrist, wrist+pelvis, wrist+heading, none");
    }
    networks.emplace(name, LoadReachNetwork(text.substr(equals + 1), common));
  }
  return networks;
}

nlohmann::json SummaryJson(const StudySummary& summary) {
  const wandr::ReachSummary& s = summary.reach;
  const bool any = std::isfinite(s.speed_at_reach_m_s);
  return {{"motions", s.count},
          {"success_ratio", s.success},
          {"success_at_end_ratio", s.success_at_end},
          {"rests_ratio", s.rests},
          {"distance_to_goal_mean_m", s.distance_mean_m},
          {"distance_to_goal_median_m", s.distance_median_m},
          {"foot_skating_ratio", summary.surface_skating},
          {"foot_skating_joints_ratio", s.skating},
          {"airborne_ratio", s.airborne},
          {"peak_pelvis_median_m_s", s.peak_pelvis_median_m_s},
          {"acceleration_mean_m_s2", s.acceleration_m_s2},
          {"wrist_speed_at_reach_m_s", any ? nlohmann::json(s.speed_at_reach_m_s) : nullptr},
          {"diverged", s.diverged}};
}

nlohmann::json RunJson(const StudyRun& run) {
  nlohmann::json json = {{"variant", run.variant->key},
                         {"deadline", run.deadline},
                         {"how", run.how},
                         {"summary", SummaryJson(run.summary)}};
  json.update(PlacesJson(run, false));
  const ReachVariant& v = *run.variant;
  if (v.paper_success) {
    json["paper"] = {{"success_ratio", *v.paper_success},
                     {"foot_skating_ratio", *v.paper_skating},
                     {"distance_to_goal_mean_m", *v.paper_distance_m}};
  }
  return json;
}

// What a reader must know about the numbers.
std::vector<std::string> NotesOf(const EvaluateReachOptions& options, const ReachNetwork& network,
                                 const std::vector<wandr::ReachStart>& starts,
                                 const wandr::ReachProtocol& adaptive, bool masked) {
  std::vector<std::string> notes = StudyNotes(
      fmt::format("5 angles, 5 heights of 0 to 1.8 m and 5 distances of 0.5 to 5 m about {} start "
                  "poses, {} "
                  "sample{} each, 8 s at 30 fps; network {}.",
                  starts.size(), options.samples, options.samples == 1 ? "" : "s", network.source),
      starts, !options.starts.empty(), "Airborne: all of these above 12 cm.");
  notes.push_back(fmt::format(
      "Fixed deadline: the goal is due after 8 s, as in the paper. Adaptive: after {:g} frames and "
      "the time to walk there at {:g} m/s, {:g} to {:g} frames; then the goal is kept in mind with "
      "{:g} frames left.",
      adaptive.deadline.frames_for_reach, adaptive.deadline.walking_m_s,
      adaptive.deadline.min_frames, adaptive.deadline.max_frames,
      adaptive.intention.min_frames_left));
  notes.push_back(
      "Refitted: what 'reach' gives. Planted feet stay where they are, hands stay off the floor, "
      "and the wrist is put at the goal if the network brought it within 10 cm; SR is of what "
      "comes out.");
  if (masked) {
    notes.push_back(
        "Rows marked 'masked' leave parts of the intention out of one trained network at run time; "
        "the paper trained a network for each row.");
  }
  return notes;
}

struct Planned {
  StudyRun run;
  ReachQuestion question;
  std::string name;
};

// A network trained without a part has seen zeros there: it is told so as well.
Planned PlanRun(const ReachVariant& variant, const std::string& deadline,
                const EvaluateReachOptions& options, const ReachNetwork& network,
                const ReachNetwork* own, std::uint64_t seed) {
  Planned planned;
  planned.run.variant = &variant;
  planned.run.deadline = deadline;
  wandr::ReachProtocol& protocol = planned.run.protocol;
  if (deadline == "adaptive") protocol = wandr::ReachProtocol::Adaptive();
  protocol.num_samples = options.samples;
  protocol.sigma = options.sigma;
  protocol.seed = seed;
  protocol.with_intention = variant.with_intention;
  protocol.intention.parts = variant.parts;
  if (own != nullptr) {
    planned.run.how = fs::path(own->source).filename().string();
  } else if (variant.key != "full" && variant.with_intention && !variant.refitted) {
    planned.run.how = "masked";
  }
  planned.question = {{}, protocol, variant.key, variant.refitted, own != nullptr ? own : &network};
  planned.name = fmt::format("{}_{}", deadline, variant.key);
  return planned;
}

// All runs that are asked for, without their cases.
std::vector<Planned> PlanOf(const EvaluateReachOptions& options, const ReachNetwork& network,
                            const std::map<std::string, ReachNetwork>& others,
                            const StudyScene& scene, std::uint64_t seed) {
  std::vector<Planned> plan;
  for (const std::string deadline : {"adaptive", "fixed"}) {
    if (options.deadline != "both" && options.deadline != deadline) continue;
    for (const ReachVariant& variant : ReachVariants()) {
      if (!options.ablations && variant.key != "full" && !variant.refitted) continue;
      const auto own = others.find(variant.key);
      Planned planned = PlanRun(variant, deadline, options, network,
                                own == others.end() ? nullptr : &own->second, seed);
      planned.question.starts = scene.StartsFor(*planned.question.network);
      plan.push_back(std::move(planned));
    }
  }
  return plan;
}

}  // namespace

Outcome EvaluateReach(const EvaluateReachOptions& options, const CommonOptions& common) {
  const ReachNetwork network = LoadReachNetwork(options.weights, common);
  const std::map<std::string, ReachNetwork> others =
      AblationNetworks(options.ablation_weights, common);
  const StudyScene scene(options.starts);
  std::vector<Planned> plan = PlanOf(options, network, others, scene, common.seed);
  for (Planned& planned : plan) {
    planned.run.cases = wandr::ReachCases(planned.run.protocol, scene.bones,
                                          wandr::AsFloat(planned.question.starts));
  }
  const bool masked =
      std::ranges::any_of(plan, [](const Planned& planned) { return planned.run.how == "masked"; });
  const fs::path folder = options.output;
  const ReachStudy study(folder / "blocks", scene.lowest, scene.body, common.force,
                         NumThreads(common));
  int left = 0, total = 0;
  for (const Planned& planned : plan) {
    const int motions = static_cast<int>(planned.run.cases.size());
    total += motions;
    left += motions - study.NumDone(planned.question, planned.name);
  }
  if (left < total) {
    Note(common, fmt::format("{} of {} motions are there already", total - left, total));
  }
  const auto started = std::chrono::steady_clock::now();
  try {
    Progress progress(common, "evaluate reach");
    int done = 0;
    for (Planned& planned : plan) {
      planned.run.motions = study.Run(planned.question, planned.name, [&] {
        if (Interrupted()) throw Stopped();
        progress.Update(++done, left);
      });
      planned.run.summary = SummarizeMotions(planned.run.motions);
    }
  } catch (const Stopped&) {
    return {kInterrupted, {}, {}};
  }
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  const CapturedSkating skating =
      SkatingOf(MeasureCaptured(scene.captured, scene.lowest, scene.bones, NumThreads(common)));

  std::vector<StudyRun> runs;
  for (Planned& planned : plan) runs.push_back(std::move(planned.run));
  StudyText text;
  text.title = "Reaching, by WANDR's protocol";
  text.notes =
      NotesOf(options, network, plan[0].question.starts, wandr::ReachProtocol::Adaptive(), masked);
  nlohmann::json results = StudyHead("holdfast/evaluate-reach/1", common, network,
                                     plan[0].question.starts, !options.starts.empty(), text);
  for (const StudyRun& run : runs) results["runs"].push_back(RunJson(run));
  if (skating.clips > 0) {
    results["captured"] = {{"clips", skating.clips},
                           {"foot_skating_ratio", skating.surface},
                           {"foot_skating_joints_ratio", skating.joints},
                           {"walking_clips", skating.walking_clips},
                           {"walking_foot_skating_ratio", skating.walking_surface},
                           {"walking_foot_skating_joints_ratio", skating.walking_joints}};
  }
  return WriteStudy({options.output, text, std::move(results), StudyTable(runs, skating),
                     StudyPage(text, runs, skating), total, left, seconds});
}

void AddEvaluateReach(CLI::App& evaluate, int& exit_code) {
  struct Options {
    CommonOptions common;
    EvaluateReachOptions reach;
  };
  auto options = std::make_shared<Options>();
  EvaluateReachOptions& reach = options->reach;
  CLI::App* command = evaluate.add_subcommand(
      "reach", "Run WANDR's protocol: 3,750 motions to goals all around, with its ablations");
  AddWeightsOption(*command, reach.weights);
  command->add_option(
      "--starts", reach.starts,
      "Held-out captured clips, or a folder of them, to start from: frame 25 of six, "
      "of as many people as there are. Without them six poses of Holdfast's own");
  command->add_option("--ablation-weights", reach.ablation_weights,
                      "NAME=FILE: a network trained without parts of the intention, for the row "
                      "wrist, wrist+pelvis, wrist+heading or none. Other rows mask one network");
  command->add_flag_callback(
      "--no-ablations", [&out = reach.ablations] { out = false; }, "The full intention alone");
  AddOption(*command, "--deadline", reach.deadline,
            "When goals are due: both, adaptive or fixed (8 s)",
            CLI::IsMember({"both", "adaptive", "fixed"}));
  AddOption(*command, "--samples", reach.samples, "Motions to each goal; the paper has 5",
            CLI::Range(1, 100));
  AddOption(*command, "--sigma", reach.sigma, "Standard deviation of the latents",
            CLI::Range(0.0, 3.0));
  std::vector<std::string> names = ReachMethodNames();
  names.push_back("all");
  command
      ->add_option("--methods", reach.methods,
                   "Methods to compare in place of ablations (comma separated): the network's "
                   "intention, optimized latents, the paper's baseline, or all")
      ->delimiter(',')
      ->capture_default_str()
      ->check(CLI::IsMember(names));
  AddOption(*command, "--goals", reach.goals,
            "Number of the protocol's motions, evenly spread, for slow methods; 0: all. A "
            "larger number later reuses these. With --track: goals of each kind [6]",
            CLI::Range(0, 1000000));
  command
      ->add_flag("--track", reach.track,
                 "Goals that move for 20 s and are followed frame by frame: at 1 m/s with turns, "
                 "with jumps of 1 m, with pushes of 0.3 m")
      ->excludes(command->get_option("--methods"));
  command
      ->add_option("-o,--output", reach.output,
                   "Folder for results.json, results.md, report.html and blocks of motions; "
                   "continued if it exists")
      ->required();
  AddCommonOptions(
      *command, options->common, true,
      "  holdfast evaluate reach -o out/reach\n"
      "  holdfast evaluate reach --weights out/wandr/best.safetensors \\\n"
      "      --starts reaches/captured/held_out -o out/mine\n"
      "  holdfast evaluate reach --methods all --goals 150 -o out/methods\n"
      "  holdfast evaluate reach --track --starts reaches/captured/held_out -o out/track\n");
  command->callback([options, &exit_code] {
    const auto run = options->reach.track              ? EvaluateTrack
                     : ComparesMethods(options->reach) ? CompareReachMethods
                                                       : EvaluateReach;
    const Outcome outcome = run(options->reach, options->common);
    if (!outcome.summary.is_null()) PrintResult(options->common, outcome.summary, outcome.text);
    exit_code = outcome.exit_code;
  });
}

}  // namespace holdfast::apps
