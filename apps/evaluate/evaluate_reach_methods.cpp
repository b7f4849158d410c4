// SPDX-License-Identifier: MIT
#include "apps/evaluate/evaluate_reach_methods.h"

#include <algorithm>
#include <chrono>

#include <fmt/format.h>

#include "apps/evaluate/reach_study_methods_page.h"
#include "apps/evaluate/reach_study_output.h"
#include "apps/interrupt.h"
#include "apps/motion/reach_network.h"
#include "generator/scripted/reach_motion.h"
#include "generator/wandr/motion_states.h"
#include "solver/evaluation/captured_reaches.h"
#include "solver/evaluation/reach_method_study.h"
#include "solver/evaluation/reach_methods.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> NotesOf(const EvaluateReachOptions& options, const ReachNetwork& network,
                                 const std::vector<wandr::ReachStart>& starts, int goals,
                                 int total) {
  std::string names;
  for (const wandr::ReachStart& start : starts) {
    names += fmt::format("{}{}", names.empty() ? "" : "; ", start.name);
  }
  std::vector<std::string> notes;
  notes.push_back(fmt::format(
      "Protocol of WANDR (Diomataris et al., CVPR 2024): goals all around, 0 to 1.8 m high and 0.5 "
      "to 5 m away, 8 s at 30 fps; {} of its {} motions{}; network {}.",
      goals, total,
      goals < total ? ", spread evenly over starts, directions, heights, distances and samples"
                    : "",
      network.source));
  notes.push_back(
      options.starts.empty()
          ? fmt::format("Start poses: six of Holdfast's own, none captured ({}).", names)
          : fmt::format("Start poses: held-out captured motion ({}).", names));
  notes.push_back(
      "SR: the right wrist is within 10 cm of the goal in any frame (at end: in the last). DTG: "
      "its "
      "closest approach. FS: share of frames whose lowest vertex of the body's surface moves "
      "horizontally by more than 2/3 cm to the next; by joints: the same of the lowest of ankles "
      "and balls of the feet. Feet: all of these above 12 cm, share of motions that do it at all "
      "and "
      "of frames; pelvis above 2 m/s likewise. Latents: root mean square, 1 for a sample.");
  notes.push_back(
      "VAE + opt: the network without intention, latents of a random rollout changed to bring the "
      "wrist of the last frame to the goal, by 0.5 |W - G|^2 / m^2 + 0.5e-4 |z|^2. The paper names "
      "neither objective nor optimizer: L-BFGS with step 1 and no line search is a setting of its "
      "released code; motions are those of the last iterate.");
  notes.push_back(
      "Seconds are of one core, measured on the machine that ran it: they differ from run to run, "
      "all other numbers do not.");
  return notes;
}

}  // namespace

bool ComparesMethods(const EvaluateReachOptions& options) {
  return options.goals > 0 || options.methods != std::vector<std::string>{"intention"};
}

FitOutcome CompareReachMethods(const EvaluateReachOptions& options, const CommonOptions& common) {
  const ReachNetwork network = LoadReachNetwork(options.weights);
  const wandr::Network<float> ready(network.weights);
  const std::shared_ptr<const BodyModel> body = LoadBody("");
  const BodyMeasures measures = MeasureBody(*body, {});
  const auto bones = wandr::BoneOffsetsOf(measures.rest_joints).Cast<float>();
  const wandr::LowestPoint lowest{BodySurface(body)};
  const CapturedClips captured = ReadCapturedClips(options.starts);
  const wandr::Normaliser<double> normaliser(network.weights.statistics);
  const std::vector<wandr::ReachStart> starts = captured.clips.empty()
                                                    ? wandr::ComposedStarts(measures, normaliser)
                                                    : StartsFrom(captured, normaliser);

  std::vector<MethodRun> runs;
  const ReachMethodsOptions asked{options.methods,
                                  options.deadline != "adaptive",
                                  options.deadline != "fixed",
                                  options.samples,
                                  options.sigma,
                                  common.seed};
  for (ReachMethod& method : ReachMethodsOf(asked, {ready, bones, measures})) {
    runs.push_back({std::move(method), {}, {}, {}});
  }
  std::vector<int> cases = SpreadCases(runs[0].method.protocol, static_cast<int>(starts.size()));
  const int all_cases = static_cast<int>(cases.size());
  if (options.goals > 0) cases.resize(std::min(options.goals, all_cases));

  const fs::path folder = options.output;
  const MethodStudy study(folder / "blocks", lowest, bones, common.force, NumThreads(common));
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
      run.summary = SummariseMethod(run.motions);
      const std::vector<wandr::ReachCase> of_protocol =
          wandr::ReachCases(run.method.protocol, bones, wandr::AsFloat(starts));
      for (const int index : cases) run.cases.push_back(of_protocol[index]);
    }
  } catch (const Stopped&) {
    return {kInterrupted, {}, {}};
  }
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  const std::vector<CapturedMotion> held_out =
      MeasureCaptured(captured, lowest, bones, NumThreads(common));

  StudyText text;
  text.title = "Reaching, method by method";
  text.notes = NotesOf(options, network, starts, static_cast<int>(cases.size()), all_cases);
  nlohmann::json results = StudyHead("holdfast/evaluate-reach-methods/1", common, network, starts,
                                     !captured.clips.empty(), text);
  results["goals"] = cases.size();
  results.update(MethodsJson(runs, held_out));
  return WriteStudy({options.output, text, std::move(results), MethodsTable(runs, held_out),
                     MethodsPage(text, runs, held_out), total, left, seconds});
}

}  // namespace holdfast::apps
