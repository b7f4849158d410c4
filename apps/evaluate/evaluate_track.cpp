// SPDX-License-Identifier: MIT
#include "apps/evaluate/evaluate_track.h"

#include <filesystem>

#include <fmt/format.h>

#include "apps/output.h"
#include "apps/reach_network.h"
#include "generator/wandr/motion_states.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/json_file.h"
#include "solver/evaluation/captured_reaches.h"
#include "solver/evaluation/track_study.h"

namespace holdfast::apps {
namespace {

constexpr int kTracks = 6, kTrackFrames = 600;

// Frame 25 of captured clips of as many people as there are, on the embedded body; or who stands.
std::vector<ReachPerson> PersonsOf(const std::vector<std::string>& starts) {
  const ReachPerson standing = StandingPerson(BodyModel::Default());
  if (starts.empty()) return {standing};
  const CapturedClips captured = ReadCapturedClips(starts);
  std::vector<wandr::StartCandidate> candidates;
  for (std::size_t i = 0; i < captured.clips.size(); ++i) {
    const Clip& clip = captured.clips[i];
    const double frames = clip.NumFrames() * wandr::kFramesPerSecond / clip.frame_rate;
    candidates.push_back({captured.names[i], clip.subject, static_cast<int>(frames)});
  }
  std::vector<ReachPerson> persons;
  for (const int chosen : wandr::ChooseStartClips(candidates)) {
    ReachPerson person = standing;
    const wandr::StateMatrix<double> states =
        wandr::StatesOfClip(captured.clips[static_cast<std::size_t>(chosen)]);
    person.states = states.leftCols(wandr::kReachStartFrame + 1);
    persons.push_back(std::move(person));
  }
  return persons;
}

nlohmann::json TrackRow(const TrackSummary& sum) {
  return {{"kind", TrackKindName(sum.kind)},
          {"tracks", sum.tracks},
          {"goal_distance_after_1_s_mean_m", sum.mean_m},
          {"goal_distance_of_the_worst_track_m", sum.worst_mean_m},
          {"foot_skating_ratio", sum.skating},
          {"airborne_ratio", sum.airborne},
          {"acceleration_mean_m_s2", sum.acceleration_m_s2},
          {"lowest_pelvis_m", sum.lowest_pelvis_m},
          {"lowest_foot_joint_m", sum.lowest_foot_m},
          {"events", sum.events},
          {"recovered", sum.recovered},
          {"ms_per_frame", sum.ms_per_frame},
          {"ms_slowest_frame", sum.ms_slowest}};
}

// Without times, which differ from run to run.
std::string TrackTable(const std::vector<TrackSummary>& summaries) {
  std::string table =
      "| goals | distance after 1 s | worst track | FS | airborne | acceleration | lowest pelvis | "
      "recovered |\n|---|---|---|---|---|---|---|---|\n";
  for (const TrackSummary& sum : summaries) {
    table += fmt::format(
        "| {} | {:.1f} cm | {:.1f} cm | {:.1f} % | {:.1f} % | {:.1f} m/s2 | {:.2f} m | {} |\n",
        TrackKindName(sum.kind), 100.0 * sum.mean_m, 100.0 * sum.worst_mean_m, 100.0 * sum.skating,
        100.0 * sum.airborne, sum.acceleration_m_s2, sum.lowest_pelvis_m,
        sum.events == 0 ? "-" : fmt::format("{} of {}", sum.recovered, sum.events));
  }
  return table;
}

}  // namespace

Outcome EvaluateTrack(const EvaluateReachOptions& options, const CommonOptions& common) {
  const ReachNetwork network = LoadReachNetwork(options.weights, common);
  const std::vector<ReachPerson> persons = PersonsOf(options.starts);
  TrackStudyOptions study;
  study.tracks = options.goals > 0 ? options.goals : kTracks;
  study.frames = kTrackFrames;
  study.follow.seed = common.seed;
  study.threads = NumThreads(common);
  Progress progress(common, "evaluate reach");
  int done = 0;
  study.progress = [&] {
    if (Interrupted()) throw Stopped();
    progress.Update(++done, 3 * study.tracks);
  };
  std::vector<TrackSummary> summaries;
  try {
    summaries = RunTrackStudy(persons, network.weights, study);
  } catch (const Stopped&) {
    return {kInterrupted, {}, {}};
  }
  Outcome outcome;
  outcome.summary = JsonHead("holdfast/evaluate-track/1", common);
  outcome.summary["network"] = NetworkJson(network);
  outcome.summary["starts"] = options.starts;
  outcome.summary["seconds_of_each_track"] = kTrackFrames / wandr::kFramesPerSecond;
  for (const TrackSummary& sum : summaries) outcome.summary["kinds"].push_back(TrackRow(sum));
  const std::string table = TrackTable(summaries);
  const std::filesystem::path folder = options.output;
  std::filesystem::create_directories(folder);
  WriteWithoutWallTimes(outcome.summary, folder / "results.json", folder / "timing.json");
  WriteAtomically(folder / "results.md", table);
  outcome.summary["output"] = options.output;
  outcome.text = table;
  for (const TrackSummary& sum : summaries) {
    outcome.text +=
        fmt::format("{}: {:.1f} ms a frame\n", TrackKindName(sum.kind), sum.ms_per_frame);
  }
  outcome.text += fmt::format("\nresults.json, results.md and timing.json in {}\n", options.output);
  return outcome;
}

}  // namespace holdfast::apps
