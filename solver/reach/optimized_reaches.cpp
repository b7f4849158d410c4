// SPDX-License-Identifier: MIT
#include "solver/reach/optimized_reaches.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <numbers>
#include <span>
#include <vector>

#include <fmt/format.h>

#include "generator/matching/capture_set.h"
#include "generator/nn/random_stream.h"
#include "generator/scripted/reach_motion.h"
#include "generator/wandr/goal_plan.h"
#include "generator/wandr/motion_states.h"
#include "generator/wandr/reach_outcome.h"
#include "generator/wandr/walk_pace.h"
#include "geometry/error.h"
#include "geometry/io/container/json_file.h"
#include "geometry/parallel.h"
#include "geometry/seed.h"
#include "solver/body_ik/reach_clip.h"
#include "solver/body_ik/reach_refit.h"
#include "solver/latent/latent_optimizer.h"
#include "solver/latent/latent_terms.h"

namespace holdfast {
namespace {

using nlohmann::json;

constexpr int kTogether = 16;    // reaches per batch
constexpr int kRound = 4;        // batches between manifest updates
constexpr int kAfter = 45;       // minimum frames after the deadline
constexpr int kMaxAfter = 90;    // maximum frames kept after it
constexpr int kMaxFrames = 200;  // maximum deadline
constexpr int kEdge = 5;         // first and last frames of a clip that are not used as starts
constexpr double kNearest_m = 0.25, kNear_m = 1.2, kLowest_m = 0.1, kHighest_m = 1.9;
constexpr double kLowestPelvis_m = 0.7;  // of a standing or walking person
constexpr double kOffGoal_m = 0.02, kFastest_m_s = 2.1;

struct Start {
  std::string name;
  wandr::StateMatrix<double> states;
};

class ReachDrawer {
 public:
  ReachDrawer(const CaptureSet& set, const wandr::NetworkWeights& network,
              const BodyMeasures& measures)
      : network_(network),
        normalizer_(network.statistics),
        bones_(wandr::BoneOffsetsOf(measures.rest_joints)) {
    for (const Capture& capture : set.captures) {
      if (capture.held_out || !capture.fault.empty()) continue;
      if (capture.clip.NumFrames() < 4 * kEdge) continue;
      starts_.push_back({capture.name, wandr::StatesOfClip(capture.clip)});
      // Favors longer clips, by the square root of their length.
      total_ += std::sqrt(static_cast<double>(starts_.back().states.cols()));
      upto_.push_back(total_);
    }
    if (starts_.empty()) {
      throw Error(set.name, "has no clip to start from",
                  "Give captures of people who stand or walk");
    }
  }

  /// Draws task `index` with its start.
  ReachTask Draw(const OptimizedReachesOptions& options, int index, json& line) const {
    constexpr int kTries = 1000;
    const wandr::DeadlineRule rule;
    RandomDraws draws(MixSeed(options.seed, static_cast<std::uint64_t>(index)));
    for (int tried = 0; tried < kTries; ++tried) {
      const auto at = static_cast<std::size_t>(
          std::ranges::lower_bound(upto_, draws.Uniform(0.0, total_)) - upto_.begin());
      const Start& start = starts_[std::min(at, starts_.size() - 1)];
      const int frame = kEdge + draws.Index(static_cast<int>(start.states.cols()) - 2 * kEdge);
      ReachTask task;
      task.start = wandr::StartAtFrame(start.states, frame, normalizer_).Cast<float>();
      const Eigen::Vector3d pelvis =
          task.start.pose.translation.cast<double>() + bones_.offset.col(0);
      task.goal = DrawGoal(task, pelvis, options.farthest_m, draws);
      task.velocity = wandr::StartVelocity(network_, task.start);
      task.deadline = wandr::PaceOf(task.start, pelvis, task.velocity, task.goal).Deadline();
      // A quarter have time left, by WANDR's deadline rule: those who are early wait upright.
      if (draws.Uniform(0.0, 1.0) < 0.25) {
        task.deadline = std::max(task.deadline, rule.Frames((task.goal - pelvis).head<2>().norm()));
      }
      task.seed = options.seed;
      task.stream = static_cast<std::uint64_t>(index);
      if (pelvis.z() < kLowestPelvis_m || task.deadline > kMaxFrames) continue;
      line = {{"index", index},
              {"start", start.name},
              {"start_frame", frame},
              {"goal_m", {task.goal.x(), task.goal.y(), task.goal.z()}},
              {"frame", task.deadline}};
      return task;
    }
    throw Error("captures", "nobody stands or walks in them",
                "Give captures of people who stand or walk");
  }

  const wandr::Network<float>& Network() const { return network_; }

 private:
  // 60 % of the goals are ahead, the others anywhere; half are near table height. Near goals
  // require a few steps, which long walks do not teach.
  static Eigen::Vector3d DrawGoal(const ReachTask& task, const Eigen::Vector3d& pelvis,
                                  double farthest, RandomDraws& draws) {
    const wandr::Matrix3<double> root = task.start.pose.rotation[0].cast<double>();
    const double ahead = std::atan2(root(1, 2), root(0, 2));
    const bool near = draws.Uniform(0.0, 1.0) < 0.25;
    const double distance =
        draws.Uniform(kNearest_m, near ? std::min(kNear_m, farthest) : farthest);
    const double angle = draws.Uniform(0.0, 1.0) < 0.6
                             ? 70.0 / 180.0 * std::numbers::pi * draws.Normal()
                             : draws.Uniform(-std::numbers::pi, std::numbers::pi);
    const double height = draws.Uniform(0.0, 1.0) < 0.5 ? draws.Uniform(kLowest_m, kHighest_m)
                                                        : draws.Uniform(0.7, 1.6);
    return {pelvis.x() + distance * std::cos(ahead + angle),
            pelvis.y() + distance * std::sin(ahead + angle), height};
  }

  wandr::Network<float> network_;
  wandr::Normalizer<double> normalizer_;
  wandr::BoneOffsets<double> bones_;
  std::vector<Start> starts_;
  std::vector<double> upto_;
  double total_ = 0.0;
};

// Data shared by all reaches.
struct OptimizedWorkshop {
  const CaptureSet& set;
  const OptimizedReachesOptions& options;
  const std::filesystem::path& folder;
  BodyMeasures measures;
  ReachDrawer drawer;
  LatentBody body;
  LatentOptions latent;
};

// Reason to drop a motion from the set; empty if it is kept.
std::string FaultOf(const Eigen::MatrixXf& joints, const ReachTask& task) {
  const wandr::ReachOutcome outcome = wandr::MeasureReach(joints, task.goal);
  const Eigen::Vector3d wrist =
      joints.block<3, 1>(Eigen::Index{3} * WristJoint(Side::kRight), task.deadline).cast<double>();
  if (outcome.diverged || !((wrist - task.goal).norm() <= kOffGoal_m)) return "misses its goal";
  if (outcome.airborne_share > 0.0) return "leaves the ground";
  if (outcome.peak_pelvis_m_s > kFastest_m_s) return "runs";
  if (!outcome.Rests()) return "does not stay at its goal";
  return {};
}

// Refits, trims and writes a reach unless it has a fault; completes its manifest line.
void FinishReach(const OptimizedWorkshop& shop, const ReachTask& task,
                 const wandr::RolloutTrack& track, json& line) {
  const std::string file = fmt::format("reach_{:05d}.npz", line["index"].get<int>());
  const RefitGoal goal{task.goal, task.deadline, true};
  wandr::StateMatrix<double> states =
      RefitReach(shop.measures, track.states.cast<double>(), {&goal, 1});
  const Eigen::Index kept = std::min<Eigen::Index>(states.cols(), task.deadline + kMaxAfter + 1);
  states.conservativeResize(Eigen::NoChange, kept);
  const std::string fault =
      FaultOf(wandr::JointsOfStates(states.cast<float>(), shop.body.bones), task);
  line["frames"] = kept;
  if (!fault.empty()) {
    line["dropped"] = fault;
    std::error_code error;  // left from an earlier run
    std::filesystem::remove(shop.folder / file, error);
    return;
  }
  Clip clip = wandr::ClipOfStates(states);
  clip.body_model = shop.set.body_model;
  clip.action = "reach";
  const ReachLabel label{.goal = task.goal, .frame = task.deadline};
  WriteGoalClip(std::move(clip), {&label, 1},
                {{"made_by", "holdfast make-reach-data " + shop.options.version},
                 {"start", line["start"]},
                 {"start_frame", line["start_frame"]}},
                shop.folder / file);
  line["file"] = file;
}

std::vector<json> OptimizeTogether(const OptimizedWorkshop& shop, int first, int count) {
  std::vector<json> lines(static_cast<std::size_t>(count));
  std::vector<ReachTask> tasks;
  int longest = 0;
  for (int k = 0; k < count; ++k) {
    tasks.push_back(shop.drawer.Draw(shop.options, first + k, lines[k]));
    longest = std::max(longest, tasks.back().deadline);
  }
  for (ReachTask& task : tasks) task.num_steps = longest + kAfter;
  const std::vector<ReachSolution> solutions =
      OptimizeLatents(shop.drawer.Network(), shop.body, tasks, shop.latent, 1, {});
  for (std::size_t k = 0; k < tasks.size(); ++k) {
    FinishReach(shop, tasks[k], solutions[k].track, lines[k]);
  }
  return lines;
}

// First indices of groups with missing reaches. Reaches of a group share their length, so groups
// are generated as a whole.
std::vector<int> GroupsToMake(const ManifestLines& lines, int count) {
  std::vector<int> groups;
  for (int index = 0; index < count; ++index) {
    const int first = index / kTogether * kTogether;
    if (!lines.contains(index) && (groups.empty() || groups.back() != first)) {
      groups.push_back(first);
    }
  }
  return groups;
}

OptimizedReachesReport ReportOf(const ManifestLines& lines) {
  OptimizedReachesReport report;
  for (const auto& [index, line] : lines) {
    const bool kept = line.contains("file");
    (kept ? report.kept : report.dropped) += 1;
    if (kept) report.minutes += line.at("frames").get<double>() / wandr::kFramesPerSecond / 60.0;
  }
  return report;
}

}  // namespace

OptimizedReachesReport MakeOptimizedReaches(const CaptureSet& set, const BodyModel& body,
                                            const wandr::NetworkWeights& network,
                                            const OptimizedReachesOptions& options,
                                            const std::filesystem::path& folder,
                                            const StagedProgress& progress) {
  const BodyMeasures measures = MeasureBody(body, {});
  OptimizedWorkshop shop{set,
                         options,
                         folder,
                         measures,
                         ReachDrawer(set, network, measures),
                         LatentBodyOf(measures.rest_joints, measures.sole_y),
                         {}};
  shop.latent.path = options.path_weight;
  const json head = {{"schema", "holdfast/optimized-reaches/1"},
                     {"holdfast_version", options.version},
                     {"seed", options.seed},
                     {"options",
                      {{"captures", set.name},
                       {"network", options.network},
                       {"farthest_m", options.farthest_m},
                       {"path_weight", options.path_weight}}},
                     {"body", set.body_model}};
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  const std::filesystem::path manifest = folder / "manifest.json";
  ManifestLines lines =
      LinesBefore(manifest, head, "make-reach-data --optimized", "captures", options.replace);
  UseJson(manifest, [&] { DropLost(lines, folder); });
  const std::vector<int> missing = GroupsToMake(lines, options.count);
  std::mutex lock;
  int done = options.count;
  for (const int first : missing) done -= std::min(kTogether, options.count - first);
  bool stopped = false;
  const auto goes_on = [&](int more) {
    const std::scoped_lock guard(lock);
    done += more;
    return !(stopped =
                 stopped || (progress && !progress("reaches optimized", done, options.count)));
  };
  for (std::size_t made = 0; made < missing.size() && goes_on(0); made += kRound) {
    std::array<std::vector<json>, kRound> round;
    ParallelFor(kRound, options.threads, [&](int k) {
      const std::size_t at = made + static_cast<std::size_t>(k);
      if (at >= missing.size() || !goes_on(0)) return;
      const int count = std::min(kTogether, options.count - missing[at]);
      round[k] = OptimizeTogether(shop, missing[at], count);
      goes_on(count);
    });
    if (stopped) break;
    for (std::vector<json>& part : round) {
      for (json& line : part) {
        const int index = line.at("index").get<int>();
        lines.insert_or_assign(index, std::move(line));
      }
    }
    WriteManifest(manifest, head, lines);
  }
  OptimizedReachesReport report = UseJson(manifest, [&] { return ReportOf(lines); });
  report.stopped = stopped;
  return report;
}

}  // namespace holdfast
