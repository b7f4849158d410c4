// SPDX-License-Identifier: MIT
#include "solver/reach/reach_and_take.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"
#include "solver/reach/reach_motions.h"

namespace holdfast {
namespace {

constexpr int kShortestStay = 12;       // frames
constexpr std::uint64_t kOther = 7919;  // seeds apart: other motions for another attempt

ReachObstacle TableOf(const TakePlan& plan, Side side, int threads) {
  TriangleMesh table = plan.table.Mesh();
  for (Eigen::Index i = 0; i < table.vertices.cols(); ++i) {
    table.vertices.col(i) = plan.table.world_from_table * Eigen::Vector3d(table.vertices.col(i));
  }
  return MakeObstacle("table", std::move(table), side, threads);
}

}  // namespace

TakeReport ReachAndTake(const ReachPerson& person, const wandr::NetworkWeights& network,
                        const TakeRequest& request, const PreparedObject& object,
                        ReachOptions options, const StagedProgress& progress) {
  options.side = request.side;
  options.threads = request.threads;
  const auto motions = [&](const TakePlan& plan, int attempt) {
    ReachOptions asked = options;
    asked.seed = request.seed + kOther * static_cast<std::uint64_t>(attempt);
    std::vector<Eigen::Vector3d> wrists;
    for (const TakeGoal& goal : plan.goals) {
      wrists.push_back(goal.wrist);
      asked.stay_frames.push_back(std::max(
          kShortestStay, static_cast<int>(std::lround(wandr::kFramesPerSecond * goal.stay_s))));
    }
    if (asked.by == ReachBy::kLatents) {
      asked.obstacles.push_back(TableOf(plan, asked.side, asked.threads));
    }
    std::vector<TakeBodyMotion> taken;
    const ReachMotions made = MakeReachMotions(person, network, wrists, asked, progress);
    for (const wandr::ReachSample& sample : made.samples) {
      if (sample.diverged || sample.NumReached() < static_cast<int>(wrists.size())) continue;
      TakeBodyMotion motion;
      motion.states = sample.track.states.cast<double>();
      for (const wandr::GoalOutcome& goal : sample.goals) {
        motion.frames.push_back(goal.closest_frame);
      }
      taken.push_back(std::move(motion));
    }
    return taken;
  };
  return TakeFromTable(request, {person.body, person.betas, person.like, person.Pelvis()}, object,
                       motions, progress);
}

void RequireTaken(const TakeReport& report, const std::string& object) {
  switch (report.status) {
    case TakeStatus::kTaken:
    case TakeStatus::kStopped:
      return;
    case TakeStatus::kNoGrasp:
      throw FitFailure(fmt::format("{}: {}. Try the other --wrist, or another --object-scale",
                                   object, Describe(report.plan.status)));
    case TakeStatus::kNoMotion:
      throw FitFailure(fmt::format("{}: {}. Try another --seed, or goals nearer to one another",
                                   object, report.motion.fault));
    case TakeStatus::kMissed:
      throw FitFailure(fmt::format(
          "{}: the hand stays {:.0f} cm from the object, which is too far, too high or too low for "
          "this body. Move the first --goal, or try another --seed",
          object, 100.0 * report.motion.take_wrist_error_m));
  }
}

}  // namespace holdfast
