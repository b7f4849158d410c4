// SPDX-License-Identifier: MIT
#include "apps/reach_motions.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "apps/interrupt.h"
#include "generator/wandr/motion_states.h"
#include "geometry/error.h"
#include "geometry/mesh/signed_distance.h"
#include "solver/latent/reach_by_optimisation.h"

namespace holdfast::apps {
namespace {

BodyMeasures MirroredMeasures(const BodyMeasures& measures) {
  BodyMeasures mirrored = measures;
  for (Eigen::Index k = 0; k < measures.rest_joints.cols(); ++k) {
    mirrored.rest_joints.col(k) =
        wandr::MirroredPoint(measures.rest_joints.col(MirrorJoint(static_cast<int>(k))));
  }
  return mirrored;
}

}  // namespace

ReachObstacle MakeObstacle(const std::string& name, TriangleMesh mesh, Side side, int threads) {
  ReachObstacle obstacle{name, std::move(mesh), nullptr};
  TriangleMesh seen = obstacle.mesh;
  if (side == Side::kLeft) {
    seen.vertices.row(0) *= -1.0;
    seen.faces.row(1).swap(seen.faces.row(2));
  }
  DistanceGridOptions grid;
  grid.cell_m = 0.02;
  grid.padding_m = 0.3;
  grid.threads = threads;
  obstacle.distance = std::make_shared<DistanceGrid>(SignedDistance(seen), grid);
  return obstacle;
}

ReachMaker::ReachMaker(const ReachJob& job, const Beginning& begin, const ReachNetwork& network,
                       const CommonOptions& common)
    : job_(job),
      begin_(begin),
      common_(common),
      side_(job.wrist == "left" ? Side::kLeft : Side::kRight),
      network_(network.weights) {
  // The network reaches with the right wrist: for the left one all happens in the mirror.
  const wandr::StateMatrix<double> states =
      side_ == Side::kLeft ? wandr::MirroredStates(begin.states) : begin.states;
  start_ = wandr::StartAtFrame(states, begin.frame,
                               wandr::Normaliser<double>(network.weights.statistics))
               .Cast<float>();
}

ReachMotions ReachMaker::Make(std::span<const Eigen::Vector3d> goals,
                              const ReachWishes& wishes) const {
  const bool mirrored = side_ == Side::kLeft;
  std::vector<Eigen::Vector3d> seen(goals.begin(), goals.end());
  if (mirrored) std::ranges::transform(goals, seen.begin(), wandr::MirroredPoint);
  const BodyMeasures measures = mirrored ? MirroredMeasures(begin_.measures) : begin_.measures;
  const auto bones = wandr::BoneOffsetsOf(measures.rest_joints).Cast<float>();
  std::optional<int> frames;
  if (job_.time_s) frames = std::max(1, static_cast<int>(std::lround(30.0 * *job_.time_s)));
  const std::uint64_t seed = common_.seed + 7919 * wishes.seed_offset;
  const int threads = NumThreads(common_);

  ReachMotions made;
  const auto started = std::chrono::steady_clock::now();
  try {
    Progress progress(common_, "reach");
    const auto see = [&](int done, int total) {
      if (Interrupted()) throw Stopped();
      progress.Update(done, total);
    };
    if (job_.Method() == "intention") {
      wandr::ReachGoalsOptions options;
      options.seed = seed;
      options.sigma = job_.sigma;
      options.frames = frames;
      made.samples = wandr::ReachGoals(network_, bones, start_, seen, job_.NumSamples(), threads,
                                       options, see);
    } else {
      ReachByOptimisationOptions options;
      options.as_published = job_.Method() == "vae-opt";
      options.refit = job_.refit && !options.as_published;
      options.seed = seed;
      options.frames = frames;
      options.stay_frames = wishes.stay_frames;
      options.latent.free_time = job_.free_time;
      if (!job_.approach.empty()) {
        Eigen::Vector3d along = ParsePoint("--approach", job_.approach);
        if (mirrored) along = wandr::MirroredPoint(along);
        if (along.norm() < 1e-6) {
          throw Error("--approach", "has no direction", "Give a vector other than 0,0,0");
        }
        options.approaches.assign(goals.size(), along.normalized());
      }
      options.vae.poll = [] {
        if (Interrupted()) throw Stopped();
      };
      options.latent.poll = options.vae.poll;
      for (const ReachObstacle& obstacle : wishes.obstacles) {
        options.latent.obstacles.push_back({obstacle.distance});
      }
      std::vector<OptimisedReach> reaches = ReachByOptimisation(
          network_, measures, start_, seen, job_.NumSamples(), threads, options, see);
      for (OptimisedReach& reach : reaches) {
        made.samples.push_back(std::move(reach.sample));
        made.refits.push_back(std::move(reach.refit));
      }
    }
  } catch (const Stopped&) {
    made.stopped = true;
    return made;
  }
  made.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  if (mirrored) {
    const auto own = begin_.bones.Cast<float>();
    for (wandr::ReachSample& sample : made.samples) {
      sample.track.states = wandr::MirroredStates(sample.track.states.cast<double>()).cast<float>();
      sample.track.joints = wandr::JointsOfStates(sample.track.states, own);
    }
  }
  return made;
}

RefitReport ReachMaker::Refit(std::span<const Eigen::Vector3d> goals,
                              wandr::ReachSample& sample) const {
  std::vector<RefitGoal> reached;
  for (std::size_t g = 0; g < goals.size(); ++g) {
    const wandr::GoalOutcome& outcome = sample.goals[g];
    if (outcome.Reached()) reached.push_back({goals[g], outcome.closest_frame});
  }
  const RefitReport report = RefitRollout(begin_.measures, reached, side_, sample.track);
  wandr::MeasureGoals(goals, WristJoint(side_), sample);
  return report;
}

}  // namespace holdfast::apps
