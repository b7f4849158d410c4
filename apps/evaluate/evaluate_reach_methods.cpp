// SPDX-License-Identifier: MIT
#include <algorithm>
#include <chrono>

#include <fmt/format.h>

#include "apps/evaluate/evaluate_reach.h"
#include "apps/evaluate/reach_study_methods_results.h"
#include "apps/evaluate/reach_study_output.h"
#include "apps/output.h"
#include "apps/reach_network.h"
#include "solver/evaluation/captured_reaches.h"
#include "solver/evaluation/reach_method_study.h"
#include "solver/evaluation/reach_methods.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> NotesOf(const EvaluateReachOptions& options, const ReachNetwork& network,
                                 const std::vector<wandr::ReachStart>& starts, int goals,
                                 int total) {
  std::vector<std::string> notes = StudyNotes(
      fmt::format(
          "goals all around, 0 to 1.8 m high and 0.5 to 5 m away, 8 s at 30 fps; {} of its {} "
          "motions{}; network {}.",
          goals, total,
          goals < total ? ", spread evenly over starts, directions, heights, distances and samples"
                        : "",
          network.source),
      starts, !options.starts.empty(),
      "Feet: all of these above 12 cm, share of motions that do it at all and of frames; pelvis "
      "above 2 m/s likewise. Latents: root mean square, 1 for a sample.");
  notes.push_back(
      "VAE + opt: the network without intention, latents of a random rollout changed to bring the "
      "wrist of the last frame to the goal, by 0.5 |W - G|^2 / m^2 + 0.5e-6 |z|^2. The paper names "
      "neither objective nor optimizer: L-BFGS with step 1 and no line search is a setting of its "
      "released code; motions are those of the last iterate. Levenberg-Marquardt begins again from "
      "other latents, twice at most, where it misses.");
  notes.push_back(
      "Seconds are of one core, measured on the machine that ran it: they differ from run to run, "
      "all other numbers do not.");
  return notes;
}

}  // namespace

bool ComparesMethods(const EvaluateReachOptions& options) {
  return options.goals > 0 || options.methods != std::vector<std::string>{"intention"};
}

Outcome CompareReachMethods(const EvaluateReachOptions& options, const CommonOptions& common) {
  const ReachNetwork network = LoadReachNetwork(options.weights, common);
  const wandr::Network<float> ready(network.weights);
  const StudyScene scene(options.starts);
  const std::vector<wandr::ReachStart> starts = scene.StartsFor(network);

  std::vector<MethodRun> runs;
  const ReachMethodsOptions asked{options.methods,
                                  options.deadline != "adaptive",
                                  options.deadline != "fixed",
                                  options.samples,
                                  options.sigma,
                                  common.seed};
  for (ReachMethod& method : ReachMethodsOf(asked, {ready, scene.bones, scene.body})) {
    runs.push_back({std::move(method), {}, {}, {}});
  }
  std::vector<int> cases = SpreadCases(runs[0].method.protocol, static_cast<int>(starts.size()));
  const int all_cases = static_cast<int>(cases.size());
  if (options.goals > 0) cases.resize(std::min(options.goals, all_cases));

  const fs::path folder = options.output;
  const MethodStudy study(folder / "blocks", scene.lowest, scene.bones, common.force,
                          NumThreads(common));
  const auto question = [&](const MethodRun& run) {
    return MethodStudy::Question{run.method, starts, network, cases};
  };
  const int total = static_cast<int>(runs.size() * cases.size());
  int left = total;
  for (const MethodRun& run : runs) left -= study.NumDone(question(run));
  if (left < total) {
    Note(common, fmt::format("{} of {} motions are there already", total - left, total));
  }
  const auto started = std::chrono::steady_clock::now();
  try {
    int done = 0;
    for (MethodRun& run : runs) {
      // One line each: methods take from milliseconds to seconds a motion.
      Progress progress(common, "evaluate reach, " + run.method.key);
      const int missing = static_cast<int>(cases.size()) - study.NumDone(question(run));
      int of_this = 0;
      run.motions = study.Run(
          question(run),
          [&](int more) {
            done += more;
            progress.Update(of_this += more, missing);
          },
          [] {
            if (Interrupted()) throw Stopped();
          });
      run.summary = SummarizeMethod(run.motions);
      run.plain.protocol = run.method.protocol;
      const std::vector<wandr::ReachCase> of_protocol =
          wandr::ReachCases(run.method.protocol, scene.bones, wandr::AsFloat(starts));
      for (const int index : cases) run.plain.cases.push_back(of_protocol[index]);
      for (const MethodMotion& one : run.motions) run.plain.motions.push_back(one.motion);
    }
  } catch (const Stopped&) {
    return {kInterrupted, {}, {}};
  }
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  const std::vector<CapturedMotion> held_out =
      MeasureCaptured(scene.captured, scene.lowest, scene.bones, NumThreads(common));

  StudyText text;
  text.title = "Reaching, method by method";
  text.notes = NotesOf(options, network, starts, static_cast<int>(cases.size()), all_cases);
  nlohmann::json results = StudyHead("holdfast/evaluate-reach-methods/1", common, network, starts,
                                     !options.starts.empty(), text);
  results["goals"] = cases.size();
  results.update(MethodsJson(runs, held_out));
  return WriteStudy({options.output, text, std::move(results), MethodsTable(runs, held_out),
                     MethodsPage(text, runs, held_out), total, left, seconds, MethodsTimes(runs),
                     MethodsTimingPage(runs)});
}

}  // namespace holdfast::apps
