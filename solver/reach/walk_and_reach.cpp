// SPDX-License-Identifier: MIT
#include "solver/reach/walk_and_reach.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "generator/walk_statistics/balance.h"
#include "generator/walk_statistics/reach_faults.h"
#include "generator/wandr/motion_states.h"
#include "generator/wandr/reach_outcome.h"
#include "geometry/error.h"
#include "geometry/parallel.h"
#include "solver/body_ik/frame_pose.h"
#include "solver/body_ik/reach_refit.h"

namespace holdfast {
namespace {

constexpr double kFarthestGoal = 20.0;   // meters: no training data walks farther
constexpr double kUsualDistance = 5.0;   // meters: maximum in training and evaluation
constexpr double kFastestWalk = 2.0;     // m/s
constexpr double kHandThickness = 0.03;  // meters

bool IsFasterThanWalking(double distance_m, const ReachOptions& options) {
  return options.time_s && distance_m / *options.time_s > kFastestWalk;
}

bool CrouchesTwice(const wandr::ReachSample& sample, const wandr::GoalOutcome& goal) {
  constexpr int kPelvisZ = 2;
  if (goal.taken_on < 0) return false;
  const Eigen::VectorXd heights = sample.track.joints.row(kPelvisZ)
                                      .segment(goal.taken_on, goal.left - goal.taken_on + 1)
                                      .transpose()
                                      .cast<double>();
  return SecondCrouch({heights.data(), static_cast<std::size_t>(heights.size())}) >= 0;
}

double OffBalanceAtEnd(const BodyMeasures& measures, const wandr::StateMatrix<float>& states) {
  constexpr Eigen::Index kFrames = 12;  // that StandsStill looks at
  const Eigen::Index count = std::min(states.cols(), kFrames);
  std::vector<BodyFrame> frames;
  for (const auto& state : states.rightCols(count).cast<double>().colwise()) {
    frames.push_back(FrameOf(wandr::PoseOf<double>(state), measures.rest_joints.col(0)));
  }
  return OffBalance(frames, measures.rest_joints, measures.sole_y, wandr::kFramesPerSecond).back();
}

ReachQuality QualityOf(const wandr::ReachSample& sample, const wandr::LowestPoint& lowest,
                       const BodyMeasures& measures, std::span<const Eigen::Vector3d> goals,
                       Side side) {
  const wandr::ReachOutcome outcome = wandr::MeasureReach(sample.track.joints, goals.back(), side);
  ReachQuality quality;
  quality.skating = wandr::SkatingOfLowestVertex(lowest, sample.track.states);
  quality.joint_skating = outcome.skating_share;
  quality.airborne = outcome.airborne_share;
  quality.peak_pelvis_m_s = outcome.peak_pelvis_m_s;
  quality.off_balance_m = OffBalanceAtEnd(measures, sample.track.states);
  // A goal that was never attempted counts with the wrist's final distance.
  const Eigen::Vector3d last =
      sample.track.joints.block<3, 1>(3 * WristJoint(side), sample.track.joints.cols() - 1)
          .cast<double>();
  for (std::size_t g = 0; g < goals.size(); ++g) {
    quality.closest_sum_m +=
        sample.goals[g].taken_on >= 0 ? sample.goals[g].closest_m : (goals[g] - last).norm();
    quality.crouches_twice += CrouchesTwice(sample, sample.goals[g]) ? 1 : 0;
  }
  return quality;
}

void SortBestFirst(std::vector<ReachMotion>& motions, int num_goals) {
  const auto key = [&](const ReachMotion& motion) {
    const int reached = motion.sample.NumReached();
    const ReachQuality& quality = motion.quality;
    return std::tuple(motion.sample.diverged, -reached, quality.crouches_twice,
                      reached == num_goals ? motion.cost : quality.closest_sum_m, motion.index);
  };
  std::ranges::sort(motions, {}, key);
}

RefitReport RefitSample(const ReachPerson& person, std::span<const Eigen::Vector3d> goals,
                        Side side, wandr::ReachSample& sample) {
  std::vector<RefitGoal> tried;
  for (std::size_t g = 0; g < goals.size(); ++g) {
    const wandr::GoalOutcome& outcome = sample.goals[g];
    if (outcome.taken_on >= 0)
      tried.push_back({goals[g], outcome.closest_frame, g + 1 == goals.size()});
  }
  const RefitReport report = RefitRollout(person.measures, tried, side, sample.track);
  wandr::MeasureGoals(goals, WristJoint(side), sample);
  return report;
}

// Motions are ranked before refitting, which is only worth its time for the best. Pinned feet may
// pull an upright pelvis down, and a person may come to rest off balance: then the next is tried.
void RefitBest(const ReachPerson& person, std::span<const Eigen::Vector3d> goals,
               const wandr::LowestPoint& lowest, const ReachOptions& options,
               std::vector<ReachMotion>& motions) {
  constexpr std::size_t kTried = 6;
  const auto refit = [&](ReachMotion& motion) {
    if (motion.sample.diverged) return;
    motion.refit = RefitSample(person, goals, options.side, motion.sample);
    motion.quality = QualityOf(motion.sample, lowest, person.measures, goals, options.side);
  };
  const int reached = motions.front().sample.NumReached();
  if (options.refit_all) {
    ParallelFor(static_cast<int>(motions.size()), options.threads,
                [&](int k) { refit(motions[k]); });
  }
  const auto faults = [](const ReachQuality& quality) {
    const double off = quality.off_balance_m;
    return std::pair(quality.crouches_twice, off > kOffBalance_m ? off : 0.0);
  };
  std::size_t best = 0;
  for (std::size_t k = 0; k < std::min(kTried, motions.size()); ++k) {
    ReachMotion& motion = motions[k];
    if (motion.sample.diverged || (k > 0 && motion.sample.NumReached() < reached)) break;
    if (!motion.refit) refit(motion);
    if (faults(motion.quality) < faults(motions[best].quality)) best = k;
    if (faults(motions[best].quality) == std::pair(0, 0.0)) break;
  }
  std::rotate(motions.begin(), motions.begin() + best, motions.begin() + best + 1);
}

std::optional<std::string> WhyMissed(const wandr::ReachSample& sample,
                                     const wandr::GoalOutcome& outcome, const Eigen::Vector3d& goal,
                                     const ReachPerson& person, const ReachOptions& options) {
  if (outcome.taken_on < 0 || outcome.Reached()) return std::nullopt;
  const double highest = person.HighestReach(options.side);
  if (goal.z() > highest) {
    return fmt::format(
        "too high: on flat feet this body's wrist reaches {:.2f} m. Try --method latent-opt, which "
        "raises the heels",
        highest);
  }
  for (const ReachObstacle& obstacle : options.obstacles) {
    if (obstacle.Distance(goal, options.side) < kHandThickness) {
      return "blocked: the goal is in an obstacle, or too close to one for a hand";
    }
  }
  const Eigen::Vector3d from = sample.track.joints.block<3, 1>(0, outcome.taken_on).cast<double>();
  const double distance = (goal - from).head<2>().norm();
  if (IsFasterThanWalking(distance, options)) {
    return fmt::format("out of time: {:.1f} m in {:.1f} s is faster than walking", distance,
                       *options.time_s);
  }
  return "no generated motion came closer: try more --samples, another --seed or --method "
         "latent-opt";
}

void RequirePossible(const Eigen::Vector3d& goal, double distance_m, const ReachOptions& options) {
  const std::string where = "goal " + GoalText(goal);
  if (goal.z() < 0.0) {
    throw Error(where, fmt::format("is {:.2f} m below the ground z = 0", -goal.z()),
                "Give a height of 0 or more: x and y are on the ground, z is up, meters");
  }
  if (distance_m > kFarthestGoal) {
    throw Error(where,
                fmt::format("is {:.1f} m away; the maximum is {:.0f} m", distance_m, kFarthestGoal),
                "Give meters, or add goals on the way");
  }
  for (const ReachObstacle& obstacle : options.obstacles) {
    const double depth = -obstacle.Distance(goal, options.side);
    if (depth <= 0.0) continue;
    throw Error(where, fmt::format("is {:.2f} m inside the obstacle {}", depth, obstacle.name),
                "Give a goal outside, or leave the obstacle out");
  }
}

}  // namespace

std::string GoalText(const Eigen::Vector3d& goal) {
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", goal.x(), goal.y(), goal.z());
}

std::vector<std::string> CheckReachGoals(std::span<const Eigen::Vector3d> goals,
                                         const ReachPerson& person, const ReachOptions& options) {
  std::vector<std::string> notes;
  const double pelvis_height = person.measures.rest_joints(1, 0) - person.measures.sole_y;
  Eigen::Vector3d from = person.Pelvis();
  if (from.z() > pelvis_height + 0.25 || from.z() < 0.0) {
    notes.push_back(
        fmt::format("the start's pelvis is {:.2f} m above z = 0, but {:.2f} m when standing: "
                    "motions assume a ground at z = 0",
                    from.z(), pelvis_height));
  }
  const double highest = person.HighestReach(options.side);
  for (const Eigen::Vector3d& goal : goals) {
    const double distance = (goal - from).head<2>().norm();
    RequirePossible(goal, distance, options);
    if (distance > kUsualDistance) {
      notes.push_back(
          fmt::format("the goal {} is {:.1f} m away, but networks are trained and evaluated only "
                      "up to {:.0f} m: the body walks toward it and may not arrive",
                      GoalText(goal), distance, kUsualDistance));
    }
    if (goal.z() > highest) {
      notes.push_back(
          fmt::format("the goal {} is higher than the {:.2f} m that this body's wrist reaches on "
                      "flat feet: it may be missed",
                      GoalText(goal), highest));
    }
    if (IsFasterThanWalking(distance, options)) {
      notes.push_back(fmt::format(
          "{:.1f} s for {:.1f} m is faster than walking: the goal {} will be late or missed",
          *options.time_s, distance, GoalText(goal)));
    }
    from = goal;
  }
  return notes;
}

ReachReport WalkAndReach(const ReachPerson& person, const wandr::NetworkWeights& network,
                         std::span<const Eigen::Vector3d> goals, const ReachOptions& options,
                         const StagedProgress& progress) {
  ReachReport report = MakeReachMotions(person, network, goals, options, progress);
  if (report.stopped) return report;
  const wandr::LowestPoint lowest(BodySurface(person.body, person.betas));
  for (ReachMotion& motion : report.motions) {
    motion.quality = QualityOf(motion.sample, lowest, person.measures, goals, options.side);
  }
  const int num_goals = static_cast<int>(goals.size());
  SortBestFirst(report.motions, num_goals);
  ReachMotion& best = report.motions.front();
  if (best.sample.diverged) return report;
  report.reach_all =
      static_cast<int>(std::ranges::count_if(report.motions, [&](const ReachMotion& motion) {
        return !motion.sample.diverged && motion.sample.NumReached() == num_goals;
      }));
  if (options.refit && options.by == ReachBy::kIntention) {
    RefitBest(person, goals, lowest, options, report.motions);
  }
  for (std::size_t g = 0; g < goals.size(); ++g) {
    report.why_missed.push_back(
        WhyMissed(best.sample, best.sample.goals[g], goals[g], person, options));
  }
  return report;
}

void RequireMade(const ReachReport& report, const std::string& source) {
  if (report.stopped || !report.motions.front().sample.diverged) return;
  throw FitFailure(fmt::format(
      "{}: the motion diverges in every sample (after {} frames in the best). Try other --weights",
      source, report.motions.front().sample.track.states.cols()));
}

Clip ClipOf(const ReachMotion& motion, const ReachPerson& person) {
  Clip clip = wandr::ClipOfStates(motion.sample.track.states.cast<double>(), person.like);
  clip.action = "reach";
  return clip;
}

}  // namespace holdfast
