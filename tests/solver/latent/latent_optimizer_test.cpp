// SPDX-License-Identifier: MIT
#include "solver/latent/latent_optimizer.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>

#include <fmt/format.h>

#include <gtest/gtest.h>

#include "generator/wandr/motion_states.h"
#include "generator/wandr/network.h"
#include "generator/wandr/reach_outcome.h"
#include "geometry/error.h"
#include "tests/geometry/mesh_shapes.h"
#include "tests/support/wandr_scene.h"

namespace holdfast {
namespace {

using Eigen::Vector3d;
using wandr::testing::DefaultBody;
using wandr::testing::DefaultBones;
using wandr::testing::SmallNetwork;
using wandr::testing::WithScaledOutput;

constexpr int kWrist = 21, kElbow = 19;

const LatentBody& Body() {
  static const LatentBody body = LatentBodyOf(DefaultBody().rest_joints, DefaultBody().sole_y);
  return body;
}

// The network that is shipped: what is wanted of the optimizer is wanted of it with that one.
struct Shipped {
  Shipped() : weights(wandr::DefaultNetwork()), network(weights) {}
  wandr::NetworkWeights weights;
  wandr::Network<float> network;
};
const Shipped& Net() {
  static const Shipped shipped;
  return shipped;
}

ReachTask Task(const wandr::NetworkWeights& weights, const Vector3d& goal, int deadline,
               int steps_after, std::uint64_t stream = 0) {
  ReachTask task;
  task.start = wandr::StartAtRest(wandr::StandingPose(DefaultBody()),
                                  wandr::Normalizer<double>(weights.statistics))
                   .Cast<float>();
  task.goal = goal;
  task.deadline = deadline;
  task.num_steps = deadline + steps_after;
  task.stream = stream;
  return task;
}

// A meter and a half away, at a walk.
ReachTask Usual(std::uint64_t stream = 0) {
  const double angle = 0.7 * static_cast<double>(stream);
  return Task(
      Net().weights,
      {1.5 * std::sin(angle), -1.5 * std::cos(angle), 1.1 - 0.15 * static_cast<double>(stream)}, 90,
      12, stream);
}

Vector3d Joint(const ReachSolution& solution, int frame, int joint) {
  return solution.track.joints.block<3, 1>(3 * joint, frame).cast<double>();
}

ReachSolution Solve(const ReachTask& task, const LatentOptions& options = {}) {
  return OptimizeLatents(Net().network, Body(), {&task, 1}, options, 1)[0];
}

void ExpectSame(const ReachSolution& a, const ReachSolution& b) {
  EXPECT_EQ(a.latents, b.latents);
  EXPECT_EQ(a.track.states, b.track.states);
  EXPECT_EQ(a.track.joints, b.track.joints);
  EXPECT_EQ(a.trace.closest_m, b.trace.closest_m);
  EXPECT_EQ(a.trace.last_m, b.trace.last_m);
}

TEST(LatentBody, HasSolesOnTheFloorAndFingertipsBeyondTheWrists) {
  const LatentBody& body = Body();
  ASSERT_EQ(body.soles.size(), 6u);
  ASSERT_EQ(body.fingertips.size(), 2u);
  std::vector<BodyPoint> points = body.soles;
  points.insert(points.end(), body.fingertips.begin(), body.fingertips.end());
  MotionView motion(points);
  motion.Resize(1);
  motion.Set(0, wandr::StandingPose(DefaultBody()), DefaultBones());
  for (int k = 0; k < 6; ++k) {
    EXPECT_NEAR(motion.At(0, kNumBodyJoints + k).z(), 0.0, 0.02) << "sole point " << k;
    // Left feet are on the left: +x of who faces -y.
    EXPECT_GT((k < 3 ? 1.0 : -1.0) * motion.At(0, kNumBodyJoints + k).x(), 0.0) << k;
  }
  for (const int first : {0, 3}) {
    const double heel = motion.At(0, kNumBodyJoints + first).y();
    const double ball = motion.At(0, kNumBodyJoints + first + 1).y();
    const double toes = motion.At(0, kNumBodyJoints + first + 2).y();
    EXPECT_GT(heel, ball);
    EXPECT_GT(ball, toes);
    EXPECT_NEAR(heel - toes, 0.25, 0.06) << "as long as a foot";
  }
  EXPECT_EQ(body.fingertips[0].joint, 20);
  EXPECT_EQ(body.fingertips[1].joint, 21);
  for (const BodyPoint& tip : body.fingertips) EXPECT_NEAR(tip.offset.norm(), 0.18, 0.03);
  EXPECT_GT(body.joint_limits[18], 1.5) << "elbows bend";
  EXPECT_LT(body.joint_limits[18], 3.1);
}

TEST(LatentOptimizer, BringsTheWristToTheGoalAtAWalk) {
  for (const std::uint64_t stream : {0u, 2u, 5u}) {
    SCOPED_TRACE(stream);
    const ReachTask task = Usual(stream);
    const ReachSolution solution = Solve(task);
    ASSERT_EQ(solution.track.states.cols(), task.num_steps + 1);
    const wandr::ReachOutcome outcome = wandr::MeasureReach(solution.track.joints, task.goal);
    EXPECT_LT(outcome.closest_m, 0.02);
    EXPECT_LT((Joint(solution, task.deadline, kWrist) - task.goal).norm(), 0.02) << "when due";
    double stay = 0.0;
    for (int t = task.deadline; t <= task.num_steps; ++t) {
      const double distance = (Joint(solution, t, kWrist) - task.goal).norm();
      // Near: the last refit puts it on the goal.
      EXPECT_LT(distance, 0.13) << "stays, frame " << t;
      stay += distance / (task.num_steps - task.deadline + 1);
    }
    EXPECT_LT(stay, 0.08);
    EXPECT_LT(outcome.peak_pelvis_m_s, 2.1);
    EXPECT_EQ(outcome.airborne_share, 0.0);
    // A motion that people make: about as likely as any.
    const double rms =
        std::sqrt(solution.latents.squaredNorm() / static_cast<float>(solution.latents.size()));
    EXPECT_GT(rms, 0.7);
    EXPECT_LT(rms, 1.6);
  }
}

// Goals that steps as people make them do not reach in time: others may.
TEST(LatentOptimizer, WhoIsLateHurries) {
  LatentOptions calm;
  calm.hurries = false;
  int again = 0;
  const Vector3d goals[] = {{3.0, 4.0, 0.3}, {0.3, -4.0, 1.0}, {-3.0, 2.0, 1.2}, {0.5, 4.0, 1.4}};
  for (int k = 0; k < 16 && again == 0; ++k) {
    const int deadline = 54 - 6 * (k / 4);
    SCOPED_TRACE(fmt::format("goal {}, {} frames", k % 4, deadline));
    const ReachTask task = Task(Net().weights, goals[k % 4], deadline, 6);
    const ReachSolution one = Solve(task, calm), best = Solve(task);
    const wandr::ReachOutcome before = wandr::MeasureReach(one.track.joints, task.goal);
    const wandr::ReachOutcome after = wandr::MeasureReach(best.track.joints, task.goal);
    const bool walks = before.airborne_share == 0.0 && before.peak_pelvis_m_s <= 3.0;
    if (before.Reached() && walks) {
      ExpectSame(one, best);
      continue;
    }
    EXPECT_GE(after.Reached(), before.Reached());
    if (after.Reached() == before.Reached()) {
      EXPECT_LE(after.airborne_share, before.airborne_share);
    }
    again += best.trace.closest_m.size() > one.trace.closest_m.size();
    EXPECT_TRUE(std::ranges::is_sorted(best.trace.seconds));
  }
  EXPECT_GT(again, 0);
}

TEST(LatentOptimizer, GivesBackTheRolloutOfItsLatents) {
  const ReachTask task = Usual(1);
  LatentOptions options;
  options.lbfgs_iterations = 10;
  options.lm_iterations = 2;
  options.lm_goal_m = 0.0;
  options.hurries = false;
  const ReachSolution solution = Solve(task, options);
  ASSERT_EQ(solution.latents.size(), Net().network.LatentSize() * task.num_steps);
  const std::vector<wandr::GoalPlan> plans = {{{task.goal, task.deadline}}};
  const auto run = [&](const Eigen::MatrixXf& latents) {
    wandr::RolloutRequest request;
    request.starts = {&task.start, 1};
    request.plans = plans;
    request.num_steps = task.num_steps;
    request.latents = &latents;
    return wandr::RunRollouts(Net().network, Body().bones, request, 1, {options.intention})[0];
  };
  const wandr::RolloutTrack again = run(solution.latents);
  EXPECT_EQ(again.states, solution.track.states);
  EXPECT_EQ(again.joints, solution.track.joints);

  // The trace begins with the sample, and has an entry for every iterate.
  const ReachTrace& trace = solution.trace;
  EXPECT_GE(trace.closest_m.size(), 1u + 10u);
  EXPECT_LE(trace.closest_m.size(), 1u + 10u + 3u);
  ASSERT_EQ(solution.solves.size(), 2u);
  EXPECT_EQ(solution.solves[0].minimizer, "LBFGS");
  EXPECT_EQ(solution.solves[0].iterations, 10);
  EXPECT_EQ(solution.solves[1].minimizer, "LEVENBERG_MARQUARDT");
  EXPECT_EQ(solution.solves[1].linear_solver, "CGNR");
  EXPECT_EQ(solution.solves[1].iterations, 2);
  EXPECT_EQ(trace.last_m.size(), trace.closest_m.size());
  EXPECT_EQ(trace.seconds.size(), trace.closest_m.size());
  EXPECT_TRUE(std::ranges::is_sorted(trace.seconds));
  const wandr::ReachOutcome sample =
      wandr::MeasureReach(run(wandr::DrawLatents(task.seed, task.stream, Net().network.LatentSize(),
                                                 task.num_steps, 1.0))
                              .joints,
                          task.goal);
  EXPECT_NEAR(trace.closest_m.front(), sample.closest_m, 1e-5);
  EXPECT_NEAR(trace.last_m.front(), sample.last_m, 1e-5);
}

TEST(LatentOptimizer, NeitherThreadsNorBatchesNorOtherTasksChangeASolution) {
  std::vector<ReachTask> tasks;
  for (std::uint64_t i = 0; i < 5; ++i) {
    tasks.push_back(
        Task(Net().weights, Usual(i).goal, 40 - static_cast<int>(i), 5 + static_cast<int>(i), i));
  }
  LatentOptions options;
  options.lbfgs_iterations = 12;
  options.lm_iterations = 3;
  const auto run = [&](int threads, int batch) {
    options.batch = batch;
    int last = 0;
    auto solutions =
        OptimizeLatents(Net().network, Body(), tasks, options, threads, [&](int done, int total) {
          EXPECT_GT(done, last);
          EXPECT_EQ(total, 5);
          last = done;
        });
    EXPECT_EQ(last, 5);
    return solutions;
  };
  const std::vector<ReachSolution> one = run(1, 16);
  for (const auto& [threads, batch] : {std::pair{2, 16}, std::pair{1, 1}, std::pair{2, 3}}) {
    SCOPED_TRACE(threads);
    const std::vector<ReachSolution> other = run(threads, batch);
    ASSERT_EQ(other.size(), one.size());
    for (std::size_t i = 0; i < tasks.size(); ++i) ExpectSame(one[i], other[i]);
  }
  for (const std::size_t i : {0u, 3u}) ExpectSame(one[i], Solve(tasks[i], options));
  EXPECT_NE(one[0].latents, one[1].latents);
}

TEST(LatentOptimizer, KeepsOutOfAnObstacleOnTheWay) {
  // A pillar to the height of the hips, half way.
  const Vector3d low(-0.2, -1.1, 0.0), high(0.2, -0.8, 1.0);
  const SignedDistance surface(testing::Box(low, high));
  DistanceGridOptions grid;
  grid.cell_m = 0.02;
  grid.padding_m = 0.3;
  const ReachTask task = Task(Net().weights, {0.0, -2.0, 1.1}, 110, 12);
  const auto deepest = [&](const ReachSolution& solution) {
    double depth = -INFINITY;
    for (int t = 0; t <= task.num_steps; ++t) {
      for (int k = 0; k < kNumBodyJoints; ++k) {
        depth = std::max(depth, -testing::BoxDistance(Joint(solution, t, k), low, high));
      }
    }
    return depth;
  };
  LatentOptions options;
  const double through = deepest(Solve(task, options));
  ASSERT_GT(through, 0.1) << "the straight way leads through it";
  options.obstacles.push_back({std::make_shared<DistanceGrid>(surface, grid)});
  const ReachSolution around = Solve(task, options);
  EXPECT_LT(deepest(around), 0.3 * through);
  EXPECT_LT((Joint(around, task.deadline, kWrist) - task.goal).norm(), 0.02);
}

TEST(LatentOptimizer, WithoutIntentionThePriorIsLedThere) {
  LatentOptions options;
  options.with_intention = false;
  for (const std::uint64_t stream : {0u, 4u}) {
    const ReachTask task = Usual(stream);
    const ReachSolution solution = Solve(task, options);
    ASSERT_GT(solution.trace.closest_m.front(), 0.4F) << "the sample knows nothing of the goal";
    EXPECT_LT(solution.trace.closest_m.back(), 0.25F * solution.trace.closest_m.front());
  }
}

TEST(LatentOptimizer, ComesAtAnyTimeWhereTimeIsFree) {
  LatentOptions options;
  options.free_time = true;
  const ReachTask task = Usual(3);
  const ReachSolution solution = Solve(task, options);
  EXPECT_LT(wandr::MeasureReach(solution.track.joints, task.goal).closest_m, 0.02);
}

TEST(LatentOptimizer, TheForearmPointsWhereItIsAsked) {
  const ReachTask task = Usual(0);
  const auto forearm = [&](const ReachSolution& solution) -> Vector3d {
    return (Joint(solution, task.deadline, kWrist) - Joint(solution, task.deadline, kElbow))
        .normalized();
  };
  LatentOptions options;
  const Vector3d usual = forearm(Solve(task, options));
  const Vector3d wanted = (usual + Vector3d(0.0, 0.0, -0.7)).normalized();
  options.approach = wanted;
  const ReachSolution solution = Solve(task, options);
  EXPECT_LT(std::acos(forearm(solution).dot(wanted)), 0.65 * std::acos(usual.dot(wanted)));
  EXPECT_LT((Joint(solution, task.deadline, kWrist) - task.goal).norm(), 0.02);
}

TEST(LatentOptimizer, WhatPollThrowsEndsTheRun) {
  const wandr::NetworkWeights weights = SmallNetwork(wandr::IntentionLayout::kFlagged, 3);
  const wandr::Network<float> network(weights);
  std::vector<ReachTask> tasks;
  for (std::uint64_t i = 0; i < 4; ++i) {
    tasks.push_back(Task(weights, {0.5, -0.5, 1.0}, 10, 2, i));
  }
  LatentOptions options;
  options.batch = 1;
  for (const int threads : {1, 2}) {
    std::atomic<int> calls = 0;
    options.poll = [&] {
      if (++calls == 5) throw std::runtime_error("enough");
    };
    EXPECT_THROW(OptimizeLatents(network, Body(), tasks, options, threads), std::runtime_error);
    EXPECT_GE(calls, 5);
    EXPECT_LE(calls, 4 + threads) << "the others end at their next call";
  }
  options.poll = {};
  EXPECT_THROW(OptimizeLatents(network, Body(), tasks, options, 2,
                               [](int, int) { throw std::runtime_error("enough"); }),
               std::runtime_error);
}

TEST(LatentOptimizer, AMotionOfOneStepIsAMotion) {
  const wandr::NetworkWeights weights = SmallNetwork(wandr::IntentionLayout::kFlagged, 3);
  const wandr::Network<float> network(weights);
  for (const bool free_time : {false, true}) {
    LatentOptions options;
    options.free_time = free_time;
    const ReachTask task = Task(weights, {0.3, -0.3, 1.0}, 1, 0);
    const ReachSolution solution = OptimizeLatents(network, Body(), {&task, 1}, options, 1)[0];
    EXPECT_EQ(solution.track.states.cols(), 2);
    EXPECT_TRUE(solution.latents.allFinite());
  }
}

TEST(LatentOptimizer, ABrokenNetworkIsSeenInTheMotion) {
  // Numbers that leave the range of float after a few steps.
  const wandr::NetworkWeights weights =
      WithScaledOutput(SmallNetwork(wandr::IntentionLayout::kFlagged, 3), 1e30F);
  const wandr::Network<float> network(weights);
  const ReachTask task = Task(weights, {0.3, -0.3, 1.0}, 20, 2);
  const ReachSolution solution = OptimizeLatents(network, Body(), {&task, 1}, {}, 1)[0];
  EXPECT_FALSE(solution.track.joints.allFinite());
  EXPECT_TRUE(wandr::MeasureReach(solution.track.joints, task.goal).diverged);
}

TEST(LatentOptimizer, RefusesTasksThatMakeNoSense) {
  const wandr::NetworkWeights weights = SmallNetwork(wandr::IntentionLayout::kFlagged, 3);
  const wandr::Network<float> network(weights);
  const auto run = [&](const std::vector<ReachTask>& tasks) {
    return OptimizeLatents(network, Body(), tasks, {}, 1);
  };
  const ReachTask sound = Task(weights, {0.5, -0.5, 1.0}, 6, 2);
  EXPECT_EQ(run({sound}).size(), 1u);
  EXPECT_THROW(run({}), Error);
  ReachTask other = sound;
  other.num_steps = 9;
  EXPECT_THROW(run({sound, other}), Error);
  for (const int deadline : {0, -3, 9}) {
    other = sound;
    other.deadline = deadline;
    EXPECT_THROW(run({other}), Error) << deadline;
  }
  other = sound;
  other.goal.z() = std::numeric_limits<double>::infinity();
  EXPECT_THROW(run({sound, other}), Error);
  other = sound;
  other.start.pose.translation.x() = NAN;
  EXPECT_THROW(run({other}), Error);
  other = sound;
  other.start.pose.rotation[7](1, 1) = NAN;
  EXPECT_THROW(run({other}), Error);
  other = sound;
  other.start.previous_delta[100] = NAN;
  EXPECT_THROW(run({other}), Error);
}

}  // namespace
}  // namespace holdfast
