// SPDX-License-Identifier: MIT
#include "solver/evaluation/reach_study.h"

#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/json_file.h"
#include "solver/body_ik/reach_refit.h"

namespace holdfast {
namespace {

constexpr int kBlock = 250;  // motions in a file
constexpr int kColumns = 12;

nlohmann::json NumberOrNull(double value) {
  return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(nullptr);
}

constexpr const char* kColumnNames[kColumns] = {"closest_m",
                                                "closest_frame",
                                                "last_m",
                                                "reached_frame",
                                                "speed_at_reach_m_s",
                                                "foot_skating_joints_ratio",
                                                "foot_skating_ratio",
                                                "airborne_ratio",
                                                "peak_pelvis_m_s",
                                                "mean_acceleration_m_s2",
                                                "diverged",
                                                "rest_m"};

}  // namespace

nlohmann::json StudyRow(const StudyMotion& motion) {
  const wandr::ReachOutcome& o = motion.outcome;
  return {o.closest_m,
          o.closest_frame,
          o.last_m,
          o.reached_frame,
          NumberOrNull(o.speed_at_reach_m_s),
          o.skating_share,
          motion.surface_skating,
          o.airborne_share,
          o.peak_pelvis_m_s,
          o.mean_acceleration_m_s2,
          o.diverged,
          o.rest_m};
}

StudyMotion StudyMotionOf(const nlohmann::json& row) {
  StudyMotion motion;
  wandr::ReachOutcome& o = motion.outcome;
  o.closest_m = row.at(0);
  o.closest_frame = row.at(1);
  o.last_m = row.at(2);
  o.reached_frame = row.at(3);
  o.speed_at_reach_m_s =
      row.at(4).is_null() ? std::numeric_limits<double>::quiet_NaN() : row.at(4).get<double>();
  o.skating_share = row.at(5);
  motion.surface_skating = row.at(6);
  o.airborne_share = row.at(7);
  o.peak_pelvis_m_s = row.at(8);
  o.mean_acceleration_m_s2 = row.at(9);
  o.diverged = row.at(10);
  o.rest_m = row.at(11);
  return motion;
}

const std::vector<ReachVariant>& ReachVariants() {
  static const std::vector<ReachVariant> variants = {
      {"full", "full intention", {}, true, false, 0.32, 0.16, 0.248},
      {"refitted", "full intention, refitted", {}, true, true, 0.32, 0.16, 0.248},
      {"wrist", "I^w alone", {true, false, false}, true, false, 0.15, 0.13, 0.629},
      {"wrist+pelvis", "I^w + I^p", {true, true, false}, true, false, 0.18, 0.17, 0.449},
      {"wrist+heading", "I^w + I^r", {true, false, true}, true, false, 0.19, 0.19, 0.360},
      {"none", "no intention", {}, false, false, std::nullopt, std::nullopt, std::nullopt},
  };
  return variants;
}

void RefitToGoal(const BodyMeasures& measures, const Eigen::Vector3d& goal,
                 wandr::RolloutTrack& track) {
  if (!track.states.allFinite()) return;
  const wandr::ReachOutcome outcome = wandr::MeasureReach(track.joints, goal);
  const RefitGoal there{goal, outcome.closest_frame, true};
  RefitRollout(measures, {&there, outcome.Reached() ? 1u : 0u}, Side::kRight, track);
}

StudySummary SummarizeMotions(std::span<const StudyMotion> motions) {
  std::vector<wandr::ReachOutcome> outcomes;
  StudySummary summary;
  for (const StudyMotion& motion : motions) {
    outcomes.push_back(motion.outcome);
    summary.surface_skating += motion.surface_skating / static_cast<double>(motions.size());
  }
  summary.reach = wandr::Summarize(outcomes);
  return summary;
}

std::string ReachQuestion::Checksum() const {
  const wandr::ReachProtocol& p = protocol;
  nlohmann::json all = {{"network", network->checksum},
                        {"columns", kColumnNames},
                        {"variant", variant},
                        {"grid", {p.num_angles, p.num_heights, p.num_distances, p.num_samples}},
                        {"range", {p.max_height_m, p.min_distance_m, p.max_distance_m}},
                        {"frames", p.num_frames},
                        {"deadline",
                         {p.deadline.frames_for_reach, p.deadline.walking_m_s,
                          p.deadline.min_frames, p.deadline.max_frames}},
                        {"intention",
                         {static_cast<int>(p.intention.wrist), p.intention.min_frames_left,
                          p.intention.hold_last_goal, p.intention.parts.wrist,
                          p.intention.parts.pelvis, p.intention.parts.heading, p.with_intention}},
                        {"sigma", p.sigma},
                        {"seed", p.seed}};
  for (const wandr::ReachStart& start : starts) {
    const wandr::StateVector<double> state = wandr::StateOf(start.start.pose);
    all["starts"].push_back(std::vector<double>(state.begin(), state.end()));
    all["starts"].push_back(
        std::vector<double>(start.start.previous_delta.begin(), start.start.previous_delta.end()));
  }
  return holdfast::Checksum(JsonText(all));
}

ReachStudy::ReachStudy(std::filesystem::path folder, const wandr::LowestPoint& lowest,
                       const BodyMeasures& body, bool replace, int threads)
    : blocks_(std::move(folder), replace),
      lowest_(lowest),
      body_(body),
      bones_(wandr::BoneOffsetsOf(body.rest_joints).Cast<float>()),
      threads_(threads) {}

std::optional<std::vector<StudyMotion>> ReachStudy::Load(const std::string& name, int block,
                                                         const std::string& checksum,
                                                         int count) const {
  std::vector<StudyMotion> motions;
  const bool there = blocks_.Read(name, block, checksum, [&](const nlohmann::json& rows) {
    for (const nlohmann::json& row : rows) motions.push_back(StudyMotionOf(row));
    return static_cast<int>(motions.size()) == count;
  });
  if (!there) return std::nullopt;
  return motions;
}

int ReachStudy::NumDone(const ReachQuestion& question, const std::string& name) const {
  const int total = question.protocol.NumCases(static_cast<int>(question.starts.size()));
  const std::string checksum = question.Checksum();
  int done = 0;
  for (int first = 0; first < total; first += kBlock) {
    const int count = std::min(kBlock, total - first);
    if (Load(name, first / kBlock, checksum, count)) done += count;
  }
  return done;
}

std::vector<StudyMotion> ReachStudy::Run(const ReachQuestion& question, const std::string& name,
                                         const std::function<void()>& progress) const {
  const std::vector<wandr::RolloutStart<float>> starts = wandr::AsFloat(question.starts);
  const int total = question.protocol.NumCases(static_cast<int>(starts.size()));
  const std::string checksum = question.Checksum();
  std::optional<wandr::Network<float>> network;  // only when something is left to run
  std::vector<StudyMotion> all;
  for (int first = 0; first < total; first += kBlock) {
    const int count = std::min(kBlock, total - first);
    std::optional<std::vector<StudyMotion>> block = Load(name, first / kBlock, checksum, count);
    if (!block) {
      if (!network) network.emplace(question.network->weights);
      block.emplace(count);
      wandr::ReachRun run;
      run.threads = threads_;
      run.first = first;
      run.count = count;
      run.progress = [&](int, int) { progress(); };
      run.see = [&](int index, const wandr::RolloutTrack& track) {
        (*block)[index - first].surface_skating =
            wandr::SkatingOfLowestVertex(lowest_, track.states);
      };
      if (question.refitted) {
        run.change = [&](const wandr::ReachCase& one, wandr::RolloutTrack& track) {
          RefitToGoal(body_, one.goal, track);
        };
      }
      const std::vector<wandr::ReachOutcome> outcomes =
          wandr::RunReachProtocol(*network, bones_, starts, question.protocol, run);
      nlohmann::json out = {{"columns", kColumnNames}};
      for (int i = 0; i < count; ++i) {
        (*block)[i].outcome = outcomes[i];
        out["motions"].push_back(StudyRow((*block)[i]));
      }
      blocks_.Write(name, first / kBlock, checksum, std::move(out));
    }
    all.insert(all.end(), block->begin(), block->end());
  }
  return all;
}

}  // namespace holdfast
