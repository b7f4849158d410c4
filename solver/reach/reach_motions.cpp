// SPDX-License-Identifier: MIT
#include "solver/reach/reach_motions.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>
#include <ranges>
#include <string>

#include "generator/wandr/motion_states.h"
#include "solver/latent/latent_terms.h"
#include "solver/latent/reach_by_optimization.h"

namespace holdfast {

namespace {

struct StopReaching {};

// Reports progress from any thread, and stops the work by an exception.
class ReachWatch {
 public:
  explicit ReachWatch(const StagedProgress& progress) : progress_(progress) {}

  void See(int done, int total) {
    const std::lock_guard lock(mutex_);
    done_ = done;
    total_ = total;
    Tell();
  }
  void Poll() {
    const std::lock_guard lock(mutex_);
    Tell();
  }

 private:
  void Tell() {
    if (progress_ && !progress_("reach", done_, total_)) throw StopReaching();
  }

  const StagedProgress& progress_;
  std::mutex mutex_;
  int done_ = 0, total_ = 1;
};

// A request as seen by the network: mirrored if the left wrist reaches.
struct ReachScene {
  ReachScene(const ReachPerson& person, const wandr::NetworkWeights& weights,
             std::span<const Eigen::Vector3d> world_goals, const ReachOptions& options)
      : mirrored(options.side == Side::kLeft),
        network(weights),
        start(wandr::StartAtFrame(mirrored ? wandr::MirroredStates(person.states) : person.states,
                                  person.Frame(), wandr::Normalizer<double>(weights.statistics))
                  .Cast<float>()),
        measures(mirrored ? MirroredMeasures(person.measures) : person.measures),
        goals(world_goals.begin(), world_goals.end()) {
    if (mirrored) std::ranges::transform(world_goals, goals.begin(), wandr::MirroredPoint);
    if (options.time_s) {
      frames =
          std::max(1, static_cast<int>(std::lround(wandr::kFramesPerSecond * *options.time_s)));
    }
  }

  bool mirrored;
  wandr::Network<float> network;
  wandr::RolloutStart<float> start;
  BodyMeasures measures;
  std::vector<Eigen::Vector3d> goals;
  std::optional<int> frames;
};

int ReachedByBest(std::span<const wandr::ReachSample> samples) {
  return std::ranges::max(samples | std::views::transform(&wandr::ReachSample::NumReached));
}

std::vector<wandr::ReachSample> ByIntention(const ReachScene& scene, const ReachOptions& options,
                                            ReachWatch& watch) {
  wandr::ReachGoalsOptions reach;
  reach.seed = options.seed;
  reach.sigma = options.sigma;
  reach.frames = scene.frames;
  const auto bones = wandr::BoneOffsetsOf(scene.measures.rest_joints).Cast<float>();
  const auto make = [&] {
    return wandr::ReachGoals(scene.network, bones, scene.start, scene.goals, options.NumSamples(),
                             options.threads, reach,
                             [&](int done, int total) { watch.See(done, total); });
  };
  std::vector<wandr::ReachSample> samples = make();
  if (scene.frames || ReachedByBest(samples) == static_cast<int>(scene.goals.size())) {
    return samples;
  }
  // The default pace is brisk.
  reach.slack = 1.5;
  std::vector<wandr::ReachSample> slower = make();
  return ReachedByBest(slower) > ReachedByBest(samples) ? slower : samples;
}

std::vector<OptimizedReach> ByOptimization(const ReachScene& scene, const ReachOptions& options,
                                           ReachWatch& watch) {
  ReachByOptimizationOptions reach;
  reach.as_published = options.by == ReachBy::kVaeOpt;
  reach.refit = options.refit && !reach.as_published;
  reach.seed = options.seed;
  reach.frames = scene.frames;
  reach.stay_frames = options.stay_frames;
  reach.latent.free_time = options.free_time;
  if (options.approach) {
    reach.latent.approach =
        scene.mirrored ? wandr::MirroredPoint(*options.approach) : *options.approach;
  }
  reach.vae = options.vae;
  reach.vae.sigma = options.sigma;
  reach.vae.poll = reach.latent.poll = [&] { watch.Poll(); };
  for (const ReachObstacle& obstacle : options.obstacles) {
    reach.latent.obstacles.push_back(obstacle.distance);
  }
  return ReachByOptimization(scene.network, scene.measures, scene.start, scene.goals,
                             options.NumSamples(), options.threads, reach,
                             [&](int done, int total) { watch.See(done, total); });
}

}  // namespace

ReachReport MakeReachMotions(const ReachPerson& person, const wandr::NetworkWeights& network,
                             std::span<const Eigen::Vector3d> goals, const ReachOptions& options,
                             const StagedProgress& progress) {
  const ReachScene scene(person, network, goals, options);
  ReachWatch watch(progress);
  ReachReport made;
  const auto started = std::chrono::steady_clock::now();
  try {
    if (options.by == ReachBy::kIntention) {
      for (wandr::ReachSample& sample : ByIntention(scene, options, watch)) {
        made.motions.emplace_back().sample = std::move(sample);
      }
    } else {
      for (OptimizedReach& reach : ByOptimization(scene, options, watch)) {
        ReachMotion& motion = made.motions.emplace_back();
        motion.sample = std::move(reach.sample);
        motion.solves = std::move(reach.solves);
        if (options.refit && options.by == ReachBy::kLatents) motion.refit = reach.refit;
      }
    }
  } catch (const StopReaching&) {
    return made;
  }
  made.stopped = false;
  const LatentBody body = LatentBodyOf(scene.measures.rest_joints, scene.measures.sole_y);
  for (std::size_t i = 0; i < made.motions.size(); ++i) {
    ReachMotion& motion = made.motions[i];
    motion.index = static_cast<int>(i);
    motion.cost = motion.sample.diverged ? INFINITY : MotionCost(body, scene.goals, motion.sample);
  }
  made.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  if (!scene.mirrored) return made;
  const auto own = person.bones.Cast<float>();
  for (ReachMotion& motion : made.motions) {
    wandr::RolloutTrack& track = motion.sample.track;
    track.states = wandr::MirroredStates(track.states.cast<double>()).cast<float>();
    track.joints = wandr::JointsOfStates(track.states, own);
  }
  return made;
}

}  // namespace holdfast
