// SPDX-License-Identifier: MIT
#include "solver/latent/rollout_cost.h"

#include <memory>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "solver/latent/latent_terms.h"
#include "tests/support/numeric_jacobian.h"
#include "tests/support/wandr_scene.h"

namespace holdfast {
namespace {

using wandr::testing::DefaultBody;
using wandr::testing::DefaultBones;
using wandr::testing::RandomStart;
using wandr::testing::SmallNetwork;

constexpr int kSteps = 7, kLatents = 8;

// Latents as Ceres has them: a block a step.
struct Blocks {
  explicit Blocks(nn::RandomStream& random)
      : z(Eigen::VectorXd::NullaryExpr(kLatents * kSteps,
                                       [&] { return 2.0 * random.Uniform() - 1.0; })) {
    for (int t = 0; t < kSteps; ++t) pointers.push_back(z.data() + kLatents * t);
  }
  Eigen::VectorXd z;
  std::vector<double*> pointers;
};

// All terms that the optimizer of whole motions has, the goal's among them, and a batch of two.
class RolloutCostOf : public ::testing::Test {
 protected:
  RolloutCostOf() {
    task_.goal = {1.0, -0.5, 1.2};
    task_.num_steps = kSteps;
    task_.deadline = kSteps - 1;
    options_.hold_frames = 1;
  }
  RolloutBatch<double> Batch(std::function<void()> poll = {}) {
    nn::RandomStream random(11);
    return {network_,
            DefaultBones(),
            options_.intention,
            {RandomStart(random), RandomStart(random)},
            {{{task_.goal, task_.deadline}}, {}},
            kSteps,
            std::move(poll)};
  }
  MotionEnergy AllTerms(MotionObjective& objective) {
    return [this, &objective](const MotionView& motion, MotionGradient& bar) {
      if (objective.NumBlocks() == 0) {
        AddNaturalTerms(body_, options_, motion, task_, objective);
        AddGoalTerms(options_, task_, 0.5, motion.NumFrames(), objective);
      }
      return objective.Evaluate(motion, &bar);
    };
  }

  wandr::NetworkWeights weights_ = SmallNetwork(wandr::IntentionLayout::kFlagged, 3);
  wandr::Network<double> network_{weights_};
  LatentBody body_ = LatentBodyOf(DefaultBody().rest_joints, DefaultBody().sole_y);
  LatentOptions options_;
  ReachTask task_;
};

TEST_F(RolloutCostOf, TheJacobianIsTheDerivative) {
  RolloutBatch<double> batch = Batch();
  MotionObjective objectives[2];
  batch.Solve([&](int i) {
    nn::RandomStream random(20 + static_cast<std::uint64_t>(i));
    Blocks at(random);
    const GoalRows goal{5, 21, task_.goal, 0.3};
    const MotionView view(PointsOf(body_));
    for (const bool with_rest : {false, true}) {
      const RolloutCost<double> cost(batch, i, view, goal,
                                     with_rest ? AllTerms(objectives[i]) : nullptr);
      EXPECT_EQ(cost.num_residuals(), with_rest ? 4 : 3);
      EXPECT_LT(testing::JacobianError(cost, at.pointers), 1e-5);
      const Eigen::VectorXd r = testing::ResidualsAt(cost, at.pointers.data());
      const Eigen::Vector3d off = cost.Motion().At(5, 21) - task_.goal;
      EXPECT_LT((r.head<3>() - off / 0.3).norm(), 1e-12);
    }
  });
}

TEST_F(RolloutCostOf, OneRowHasValueAndGradientOfAllTerms) {
  RolloutBatch<double> batch = Batch();
  MotionObjective objectives[2];
  batch.Solve([&](int i) {
    nn::RandomStream random(30 + static_cast<std::uint64_t>(i));
    const Blocks at(random);
    const RolloutCost<double> cost(batch, i, MotionView(PointsOf(body_)), {},
                                   AllTerms(objectives[i]));
    ASSERT_TRUE(cost.Look(at.z));
    const Eigen::VectorXd gradient = cost.Gradient();
    EXPECT_NEAR(cost.Value(), objectives[i].Evaluate(cost.Motion()), 1e-9 * cost.Value());
    const auto value = [&](const Eigen::VectorXd& step) {
      cost.Look(at.z + step);
      return cost.Value();
    };
    EXPECT_LT(wandr::testing::RelativeError(
                  gradient, wandr::testing::NumericGradient(value, at.z.size(), 1e-7)),
              1e-5);
  });
}

TEST_F(RolloutCostOf, IsEvaluatedOnceForTheSameLatents) {
  int passes = 0;
  RolloutBatch<double> batch = Batch([&] { ++passes; });
  nn::RandomStream random(5);
  Blocks at(random);
  batch.Solve([&](int i) {
    if (i > 0) return;
    const RolloutCost<double> cost(batch, i, MotionView(), GoalRows{kSteps, 21, task_.goal, 1.0},
                                   nullptr);
    Eigen::Vector3d r;
    std::vector<Eigen::MatrixXd> J(kSteps, Eigen::MatrixXd(kLatents, 3));
    std::vector<double*> into;
    for (Eigen::MatrixXd& block : J) into.push_back(block.data());
    EXPECT_TRUE(cost.Evaluate(at.pointers.data(), r.data(), nullptr));
    EXPECT_TRUE(cost.Evaluate(at.pointers.data(), r.data(), into.data()));
    EXPECT_EQ(passes, 1);
    at.z[3] += 1e-3;
    EXPECT_TRUE(cost.Evaluate(at.pointers.data(), r.data(), into.data()));
    EXPECT_EQ(passes, 2);
  });
}

TEST_F(RolloutCostOf, AMotionIsTheSameAloneAndAmongOthers) {
  nn::RandomStream random(6);
  const Blocks at(random);
  const GoalRows goal{kSteps, 21, task_.goal, 1.0};
  Eigen::VectorXd gradients[2];
  // The other one goes its own way, and stops earlier or later.
  for (const int others : {0, 3}) {
    RolloutBatch<double> batch = Batch();
    batch.Solve([&](int i) {
      const RolloutCost<double> cost(batch, i, MotionView(), goal, nullptr);
      if (i == 0) {
        EXPECT_TRUE(cost.Look(at.z));
        gradients[others / 3] = cost.Gradient();
      }
      for (int k = 0; i == 1 && k < others; ++k) EXPECT_TRUE(cost.Look((0.1 + k) * at.z));
    });
  }
  EXPECT_EQ(gradients[0], gradients[1]);
}

TEST_F(RolloutCostOf, WhatASolverOrPollThrowsEndsAll) {
  nn::RandomStream random(6);
  const Blocks at(random);
  const GoalRows goal{kSteps, 21, task_.goal, 1.0};
  for (const bool by_poll : {false, true}) {
    int passes = 0;
    RolloutBatch<double> batch = Batch([&] {
      if (++passes == 4 && by_poll) throw std::runtime_error("enough");
    });
    EXPECT_THROW(batch.Solve([&](int i) {
      const RolloutCost<double> cost(batch, i, MotionView(), goal, nullptr);
      for (int k = 1; cost.Look(k * at.z); ++k) {
        if (k == 3 && i == 1 && !by_poll) throw std::runtime_error("enough");
      }
    }),
                 std::runtime_error);
    EXPECT_LE(passes, 4);
  }
}

}  // namespace
}  // namespace holdfast
