// SPDX-License-Identifier: MIT
#include "solver/latent/vae_opt.h"

#include <cmath>
#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>

#include "generator/wandr/network.h"
#include "geometry/error.h"
#include "solver/latent/latent_solve.h"
#include "tests/support/wandr_scene.h"

namespace holdfast {
namespace {

using wandr::testing::DefaultBody;
using wandr::testing::DefaultBones;
using wandr::testing::SmallNetwork;
using wandr::testing::WithScaledOutput;

TEST(Adam, MovesEveryVariableByTheRateAndThenByLess) {
  // With the same gradient each time the ratio of its means is 1, whatever its size.
  const Eigen::VectorXd gradient = Eigen::Vector3d(1e-3, -2.0, 500.0);
  Eigen::VectorXd x = Eigen::Vector3d::Zero();
  Adam adam(0.1, 0.5, 3);
  for (const double moved : {0.1, 0.175, 0.225}) {
    EXPECT_TRUE(adam(moved < 0.15 ? 0 : moved < 0.2 ? 1 : 2, gradient, x));
    EXPECT_LT((x - moved * Eigen::Vector3d(-1.0, 1.0, -1.0)).norm(), 1e-4);
  }
}

TEST(LbfgsStepOne, FindsTheMinimumOfAQuadraticAndStops) {
  const Eigen::Vector3d scale(1.0, 3.0, 0.5), minimum(0.2, -1.0, 4.0);
  Eigen::VectorXd x = Eigen::Vector3d::Zero();
  LbfgsStepOne rule(10);
  int steps = 0;
  const auto gradient = [&] { return Eigen::VectorXd(scale.cwiseProduct(x - minimum)); };
  while (steps < 40 && rule(steps, gradient(), x)) {
    ++steps;
    if (steps == 1) {
      EXPECT_NEAR(x.lpNorm<1>(), 1.0, 1e-6) << "the first step is short";
    }
  }
  EXPECT_LT(steps, 40);
  EXPECT_LT((x - minimum).norm(), 1e-5);
}

// A quarter of the goals of a cylinder, or of whatever numbers a test wants.
std::vector<ReachTask> Tasks(const wandr::NetworkWeights& weights, int count, int num_steps) {
  const wandr::Normalizer<double> normalizer(weights.statistics);
  std::vector<ReachTask> tasks(count);
  for (int i = 0; i < count; ++i) {
    const double angle = 2.4 * i;
    tasks[i].start =
        wandr::StartAtRest(wandr::StandingPose(DefaultBody()), normalizer).Cast<float>();
    tasks[i].goal = {1.2 * std::cos(angle), 1.2 * std::sin(angle), 0.6 + 0.2 * (i % 5)};
    tasks[i].num_steps = tasks[i].deadline = num_steps;
    tasks[i].stream = static_cast<std::uint64_t>(i);
  }
  return tasks;
}

constexpr VaeOptMethod kMethods[] = {VaeOptMethod::kLm, VaeOptMethod::kLbfgs,
                                     VaeOptMethod::kLbfgsStepOne, VaeOptMethod::kAdam};

void ExpectSameSolution(const ReachSolution& a, const ReachSolution& b) {
  EXPECT_EQ(a.latents, b.latents);
  EXPECT_EQ(a.track.states, b.track.states);
  EXPECT_EQ(a.track.joints, b.track.joints);
  EXPECT_EQ(a.trace.closest_m, b.trace.closest_m);
  EXPECT_EQ(a.trace.last_m, b.trace.last_m);
}

TEST(VaeOpt, NeitherThreadsNorOtherTasksChangeASolution) {
  const wandr::NetworkWeights weights =
      WithScaledOutput(SmallNetwork(wandr::IntentionLayout::kFlagged, 3), 0.3F);
  const wandr::Network<float> network(weights);
  const auto bones = DefaultBones().Cast<float>();
  std::vector<ReachTask> tasks = Tasks(weights, 37, 12);
  tasks[5].num_steps = tasks[20].num_steps = 9;
  for (const VaeOptMethod method : kMethods) {
    SCOPED_TRACE(static_cast<int>(method));
    VaeOptOptions options;
    options.method = method;
    options.iterations = 8;
    const auto one = OptimizeAsPublished(network, bones, tasks, options, 1);
    const auto five = OptimizeAsPublished(network, bones, tasks, options, 5);
    ASSERT_EQ(one.size(), 37u);
    for (std::size_t i = 0; i < tasks.size(); ++i) ExpectSameSolution(one[i], five[i]);
    const auto alone = OptimizeAsPublished(network, bones, {&tasks[20], 1}, options, 2);
    ExpectSameSolution(one[20], alone[0]);
    EXPECT_EQ(alone[0].track.states.cols(), 10);
  }
}

TEST(VaeOpt, ATraceEndsWithTheMotionThatIsGivenBack) {
  const wandr::NetworkWeights weights =
      WithScaledOutput(SmallNetwork(wandr::IntentionLayout::kFlagged, 3), 0.3F);
  const wandr::Network<float> network(weights);
  const std::vector<ReachTask> tasks = Tasks(weights, 3, 12);
  for (const VaeOptMethod method : kMethods) {
    SCOPED_TRACE(static_cast<int>(method));
    VaeOptOptions options;
    options.method = method;
    options.iterations = 8;
    const auto solutions =
        OptimizeAsPublished(network, DefaultBones().Cast<float>(), tasks, options, 1);
    for (std::size_t i = 0; i < tasks.size(); ++i) {
      const ReachTrace& trace = solutions[i].trace;
      ASSERT_FALSE(trace.last_m.empty());
      // Levenberg-Marquardt begins again twice where it misses.
      EXPECT_LE(trace.last_m.size(), 9u * solutions[i].solves.size());
      EXPECT_EQ(solutions[i].solves.size() > 1, method == VaeOptMethod::kLm);
      EXPECT_EQ(trace.closest_m.size(), trace.last_m.size());
      EXPECT_EQ(trace.seconds.size(), trace.last_m.size());
      EXPECT_TRUE(std::ranges::is_sorted(trace.seconds));
      const Eigen::VectorXf last = solutions[i].track.joints.col(12);
      EXPECT_NEAR(trace.last_m.back(),
                  (last.segment<3>(3 * 21).cast<double>() - tasks[i].goal).norm(), 1e-5);
      // The first entry is the sample itself.
      VaeOptOptions none = options;
      none.iterations = 1;
      const auto start =
          OptimizeAsPublished(network, DefaultBones().Cast<float>(), {&tasks[i], 1}, none, 1);
      EXPECT_EQ(start[0].trace.last_m[0], trace.last_m[0]);
    }
  }
}

TEST(VaeOpt, BringsTheWristNearerThroughTheTrainedPrior) {
  if (!wandr::HasDefaultNetwork()) GTEST_SKIP() << "built without the trained network";
  const wandr::NetworkWeights weights = wandr::DefaultNetwork();
  const wandr::Network<float> network(weights);
  const std::vector<ReachTask> tasks = Tasks(weights, 4, 90);
  for (const VaeOptMethod method : {VaeOptMethod::kLm, VaeOptMethod::kLbfgs, VaeOptMethod::kAdam}) {
    SCOPED_TRACE(static_cast<int>(method));
    VaeOptOptions options;
    options.method = method;
    options.iterations = 60;
    for (const ReachSolution& solution :
         OptimizeAsPublished(network, DefaultBones().Cast<float>(), tasks, options, 2)) {
      EXPECT_LT(solution.trace.last_m.back(), 0.5F * solution.trace.last_m.front());
      if (method == VaeOptMethod::kLm) {
        EXPECT_LT(solution.trace.last_m.back(), 1e-3F);
        EXPECT_EQ(solution.solves.back().termination, "USER_SUCCESS");
        EXPECT_EQ(solution.solves.back().linear_solver, "CGNR");
      }
    }
  }
}

TEST(VaeOpt, StopsWhereNumbersEnd) {
  wandr::NetworkWeights weights = SmallNetwork(wandr::IntentionLayout::kFlagged, 3);
  const wandr::Network<float> network(weights);
  std::vector<ReachTask> tasks = Tasks(weights, 2, 12);
  VaeOptOptions options;
  options.method = VaeOptMethod::kAdam;
  options.iterations = 20;
  options.learning_rate = 1e38;  // latents leave the range of float after a few steps
  options.last_learning_rate_ratio = 1.0;
  const auto solutions =
      OptimizeAsPublished(network, DefaultBones().Cast<float>(), tasks, options, 1);
  for (const ReachSolution& solution : solutions) {
    EXPECT_TRUE(solution.latents.allFinite());
    EXPECT_TRUE(solution.track.joints.allFinite());
    EXPECT_LT(solution.trace.last_m.size(), 21u);
  }
}

TEST(VaeOpt, WhatPollThrowsEndsTheRun) {
  const wandr::NetworkWeights weights = SmallNetwork(wandr::IntentionLayout::kFlagged, 3);
  const wandr::Network<float> network(weights);
  const std::vector<ReachTask> tasks = Tasks(weights, 3, 12);
  for (const VaeOptMethod method : kMethods) {
    VaeOptOptions options;
    options.method = method;
    options.poll = [] { throw std::runtime_error("enough"); };
    EXPECT_THROW(OptimizeAsPublished(network, DefaultBones().Cast<float>(), tasks, options, 2),
                 std::runtime_error);
  }
}

TEST(VaeOpt, RefusesWhatMakesNoSense) {
  const wandr::NetworkWeights weights = SmallNetwork(wandr::IntentionLayout::kFlagged, 3);
  const wandr::Network<float> network(weights);
  const auto run = [&](const ReachTask& task, const VaeOptOptions& options) {
    return OptimizeAsPublished(network, DefaultBones().Cast<float>(), {&task, 1}, options, 1);
  };
  const ReachTask sound = Tasks(weights, 1, 3)[0];
  VaeOptOptions options;
  options.goal_sigma_m = 0.0;
  EXPECT_THROW(run(sound, options), Error);
  options = {};
  options.history = 0;
  EXPECT_THROW(run(sound, options), Error);
  ReachTask task = sound;
  task.num_steps = 0;
  EXPECT_THROW(run(task, {}), Error);
  task = sound;
  task.goal.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(run(task, {}), Error);
}

}  // namespace
}  // namespace holdfast
