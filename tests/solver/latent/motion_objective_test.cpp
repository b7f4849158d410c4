// SPDX-License-Identifier: MIT
#include "solver/latent/motion_objective.h"

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "generator/wandr/rollout.h"
#include "solver/terms/motion/feet_terms.h"
#include "solver/terms/motion/goal_terms.h"
#include "solver/terms/motion/posture_terms.h"
#include "tests/support/wandr_scene.h"

namespace holdfast {
namespace {

using wandr::testing::DefaultBones;
using wandr::testing::NumericGradient;
using wandr::testing::Perturbed;
using wandr::testing::RandomPose;
using wandr::testing::RandomStart;
using wandr::testing::RelativeError;

// r = sum_k A_k x_k - b, of blocks of any sizes.
class Linear final : public ceres::CostFunction {
 public:
  Linear(nn::RandomStream& random, int rows, const std::vector<MotionQuantity>& blocks) {
    set_num_residuals(rows);
    const auto draw = [&] { return 2.0 * random.Uniform() - 1.0; };
    b_ = Eigen::VectorXd::NullaryExpr(rows, draw);
    for (const MotionQuantity& block : blocks) {
      mutable_parameter_block_sizes()->push_back(block.Size());
      A_.emplace_back(Eigen::MatrixXd::NullaryExpr(rows, block.Size(), draw));
    }
  }
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    Eigen::Map<Eigen::VectorXd> r(residuals, num_residuals());
    r = -b_;
    for (std::size_t k = 0; k < A_.size(); ++k) {
      r += A_[k] * Eigen::Map<const Eigen::VectorXd>(parameters[k], A_[k].cols());
      if (jacobians == nullptr || jacobians[k] == nullptr) continue;
      Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
          jacobians[k], num_residuals(), A_[k].cols()) = A_[k];
    }
    return true;
  }

 private:
  std::vector<Eigen::MatrixXd> A_;
  Eigen::VectorXd b_;
};

const std::vector<BodyPoint>& Points() {
  static const std::vector<BodyPoint> points = {
      {10, {0.02, -0.05, 0.08}}, {21, {-0.1, 0.01, 0.02}}, {0, {0.1, 0.2, -0.1}}};
  return points;
}

MotionView ViewOf(const std::vector<wandr::Pose<double>>& poses) {
  MotionView motion(Points());
  motion.Resize(static_cast<int>(poses.size()));
  for (std::size_t t = 0; t < poses.size(); ++t) {
    motion.Set(static_cast<int>(t), poses[t], DefaultBones());
  }
  return motion;
}

// What `gradient` says of the tangents of a frame's pose, joints' share included.
wandr::TangentVector<double> OfTangents(const MotionGradient& gradient, int frame,
                                        const wandr::Pose<double>& pose) {
  wandr::BodyKinematics<double> kinematics;
  wandr::ForwardKinematics(DefaultBones(), pose, kinematics);
  wandr::TangentVector<double> tangents = gradient.poses.col(frame);
  wandr::ForwardKinematicsVjp<double>(
      kinematics, Eigen::Map<const wandr::BodyJoints<double>>(gradient.joints.col(frame).data()),
      tangents);
  return tangents;
}

void CheckGradient(const MotionObjective& objective,
                   const std::vector<wandr::Pose<double>>& poses) {
  MotionGradient gradient;
  gradient.SetZero(static_cast<int>(poses.size()));
  const double value = objective.Evaluate(ViewOf(poses), &gradient);
  EXPECT_EQ(value, objective.Evaluate(ViewOf(poses))) << "with or without gradient";
  for (std::size_t t = 0; t < poses.size(); ++t) {
    const auto moved = [&](const Eigen::VectorXd& step) {
      std::vector<wandr::Pose<double>> there = poses;
      there[t] = Perturbed(poses[t], step);
      return objective.Evaluate(ViewOf(there));
    };
    EXPECT_LT(RelativeError(OfTangents(gradient, static_cast<int>(t), poses[t]),
                            NumericGradient(moved, wandr::kTangentSize)),
              1e-6)
        << "frame " << t;
  }
}

std::vector<wandr::Pose<double>> RandomPoses(nn::RandomStream& random, int count) {
  std::vector<wandr::Pose<double>> poses;
  for (int t = 0; t < count; ++t) poses.push_back(RandomPose(random));
  return poses;
}

TEST(MotionView, HasJointsPointsAndRotations) {
  nn::RandomStream random(2);
  const std::vector<wandr::Pose<double>> poses = RandomPoses(random, 2);
  const MotionView motion = ViewOf(poses);
  ASSERT_EQ(motion.NumFrames(), 2);
  for (int t = 0; t < 2; ++t) {
    wandr::BodyKinematics<double> kinematics;
    wandr::ForwardKinematics(DefaultBones(), poses[t], kinematics);
    for (int k = 0; k < kNumBodyJoints; ++k) {
      EXPECT_EQ(motion.At(t, k), kinematics.joints.col(k));
      const double* const world = motion.Data(WorldRotation(t, k));
      const double* const local = motion.Data(LocalRotation(t, k));
      for (int i = 0; i < 9; ++i) {
        EXPECT_EQ(world[i], kinematics.world[k](i / 3, i % 3)) << "row by row";
        EXPECT_EQ(local[i], poses[t].rotation[k](i / 3, i % 3));
      }
    }
    for (std::size_t i = 0; i < Points().size(); ++i) {
      const BodyPoint& point = Points()[i];
      const Eigen::Vector3d expected =
          kinematics.joints.col(point.joint) + kinematics.world[point.joint] * point.offset;
      EXPECT_LT((motion.At(t, kNumBodyJoints + static_cast<int>(i)) - expected).norm(), 1e-14);
    }
  }
}

TEST(MotionObjective, GradientOfEveryKindOfBlockIsTheDerivative) {
  nn::RandomStream random(5);
  const std::vector<wandr::Pose<double>> poses = RandomPoses(random, 2);
  const std::vector<std::vector<MotionQuantity>> kinds = {
      {Position(0, 0)},
      {Position(0, 21)},
      {Position(1, 15)},
      {Position(0, kNumBodyJoints)},
      {Position(1, kNumBodyJoints + 1)},
      {Position(0, kNumBodyJoints + 2)},
      {LocalRotation(0, 0)},
      {LocalRotation(1, 18)},
      {WorldRotation(0, 0)},
      {WorldRotation(0, 15)},
      {WorldRotation(1, 10)},
      {Position(0, 7), Position(1, 7), WorldRotation(1, 15), LocalRotation(0, 4),
       Position(1, kNumBodyJoints + 1)}};
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    SCOPED_TRACE("kind " + std::to_string(k));
    MotionObjective objective;
    objective.Add("linear", std::make_shared<Linear>(random, 4, kinds[k]), nullptr, kinds[k]);
    CheckGradient(objective, poses);
  }
}

TEST(MotionObjective, LossesBendItAsCeresDoes) {
  nn::RandomStream random(6);
  const std::vector<wandr::Pose<double>> poses = RandomPoses(random, 2);
  const std::vector<MotionQuantity> blocks = {Position(0, 20), WorldRotation(1, 12),
                                              Position(0, kNumBodyJoints)};
  const auto cost = std::make_shared<Linear>(random, 3, blocks);
  const MotionView motion = ViewOf(poses);
  double squared = 0.0;
  {
    MotionObjective plain;
    plain.Add("plain", cost, nullptr, blocks);
    squared = 2.0 * plain.Evaluate(motion);
  }
  const std::vector<std::shared_ptr<ceres::LossFunction>> losses = {
      std::make_shared<ceres::CauchyLoss>(0.3), std::make_shared<ceres::HuberLoss>(0.1),
      std::make_shared<ceres::ScaledLoss>(nullptr, 3.0, ceres::TAKE_OWNERSHIP)};
  for (const auto& loss : losses) {
    MotionObjective objective;
    objective.Add("bent", cost, loss, blocks);
    double rho[3];
    loss->Evaluate(squared, rho);
    EXPECT_NEAR(objective.Evaluate(motion), 0.5 * rho[0], 1e-12);
    CheckGradient(objective, poses);
  }
}

TEST(MotionObjective, IsTheSumOfItsTerms) {
  nn::RandomStream random(7);
  const std::vector<wandr::Pose<double>> poses = RandomPoses(random, 2);
  const MotionView motion = ViewOf(poses);
  const auto goal = std::make_shared<NearPoint>(Eigen::Vector3d(1, 2, 3), 0.7);
  MotionObjective objective;
  EXPECT_EQ(objective.Evaluate(motion), 0.0);
  objective.Add("goal", goal, nullptr, {Position(0, 21)});
  objective.Add("other", goal, nullptr, {Position(1, 3)});
  objective.Add("goal", goal, nullptr, {Position(1, 21)});
  EXPECT_EQ(objective.NumBlocks(), 3u);
  const auto half = [&](int frame, int joint) {
    return 0.35 * (motion.At(frame, joint) - Eigen::Vector3d(1, 2, 3)).squaredNorm();
  };
  MotionGradient gradient;
  gradient.SetZero(2);
  gradient.joints(0, 0) = 5.0;  // gradients are added
  std::map<std::string, double> by_term = {{"other", 1.0}};
  const double value = objective.Evaluate(motion, &gradient, &by_term);
  EXPECT_NEAR(value, half(0, 21) + half(1, 3) + half(1, 21), 1e-12);
  EXPECT_NEAR(by_term["goal"], half(0, 21) + half(1, 21), 1e-12);
  EXPECT_NEAR(by_term["other"], 1.0 + half(1, 3), 1e-12);
  EXPECT_EQ(gradient.joints(0, 0), 5.0);
  EXPECT_LT(
      (gradient.joints.block<3, 1>(63, 1) - 0.7 * (motion.At(1, 21) - Eigen::Vector3d(1, 2, 3)))
          .norm(),
      1e-12);
  objective.Clear();
  EXPECT_EQ(objective.NumBlocks(), 0u);
  EXPECT_EQ(objective.Evaluate(motion), 0.0);
}

// Terms of all kinds over a short motion, through the network to its latents.
TEST(MotionObjective, GradientOfLatentsThroughARolloutIsTheDerivative) {
  constexpr int kSteps = 6, kBodies = 2;
  const wandr::NetworkWeights weights =
      wandr::testing::SmallResidualNetwork(wandr::IntentionLayout::kFlagged, 3);
  const wandr::Network<double> network(weights);
  nn::RandomStream random(12);
  std::vector<wandr::RolloutStart<double>> starts;
  for (int i = 0; i < kBodies; ++i) starts.push_back(RandomStart(random));
  const std::vector<wandr::GoalPlan> plans = {{{{1.5, 1.0, 1.1}, kSteps}}, {}};
  const Eigen::MatrixXd latents = Eigen::MatrixXd::NullaryExpr(
      8 * kSteps, kBodies, [&] { return 2.0 * random.Uniform() - 1.0; });

  MotionObjective objective;
  const Eigen::Vector3d goal(0.5, -0.5, 1.0);
  std::vector<MotionQuantity> all;
  for (int t = 1; t <= kSteps; ++t) all.push_back(Position(t, 21));
  objective.Add("arrival", FirstArrival(goal, kSteps, 0.3, 1.0), nullptr, all);
  objective.Add("goal", std::make_shared<NearPoint>(goal, 2.0), nullptr, {Position(kSteps, 21)});
  for (int t = 1; t < kSteps; ++t) {
    objective.Add("look", LookAt(goal, 0.5), nullptr, {WorldRotation(t, 15), Position(t, 15)});
    objective.Add("limits", RotationRange(0.05, 0.3), nullptr, {LocalRotation(t, 1 + t)});
    objective.Add("skate", FootSkate(3.0), std::make_shared<ceres::CauchyLoss>(0.02),
                  {Position(t, kNumBodyJoints), Position(t + 1, kNumBodyJoints)});
    objective.Add("speed", HorizontalLimit(0.01, 1.0 / 30.0, 0.05), nullptr,
                  {Position(t, 0), Position(t + 1, 0)});
    objective.Add("smooth", std::make_shared<JointAcceleration>(1.0 / 30.0, 1e-5), nullptr,
                  {Position(t - 1, 20), Position(t, 20), Position(t + 1, 20)});
    objective.Add("airborne", Airborne(std::vector<double>{-9.0, -9.0}, 0.01, 1.0), nullptr,
                  {Position(t, kNumBodyJoints), Position(t, 7)});
  }

  wandr::Rollout<double> rollout(network, DefaultBones(), kBodies, kSteps, {}, true);
  const auto run = [&](const Eigen::MatrixXd& z) {
    rollout.Begin(starts, plans);
    std::vector<MotionView> motions(kBodies, MotionView(Points()));
    for (int t = 0; t < kSteps; ++t) rollout.Step(z.middleRows(8 * t, 8));
    for (int i = 0; i < kBodies; ++i) {
      motions[i].Resize(kSteps + 1);
      for (int t = 0; t <= kSteps; ++t) motions[i].Set(t, rollout.Poses(t)[i], DefaultBones());
    }
    return motions;
  };
  const std::vector<MotionView> motions = run(latents);
  wandr::RolloutSeed<double> seed;
  seed.joints.resize(kSteps + 1, Eigen::MatrixXd(wandr::kJointNumbers, kBodies));
  seed.poses.resize(kSteps + 1, Eigen::MatrixXd(wandr::kTangentSize, kBodies));
  std::map<std::string, double> by_term;
  for (int i = 0; i < kBodies; ++i) {
    MotionGradient motion_bar;
    motion_bar.SetZero(kSteps + 1);
    objective.Evaluate(motions[i], &motion_bar, &by_term);
    for (int t = 0; t <= kSteps; ++t) {
      seed.joints[t].col(i) = motion_bar.joints.col(t);
      seed.poses[t].col(i) = motion_bar.poses.col(t);
    }
  }
  for (const auto& [term, value] : by_term) EXPECT_GT(value, 0.0) << term << " does not act";
  wandr::RolloutGradient<double> gradient;
  rollout.Backward(seed, 1, gradient);
  for (int i = 0; i < kBodies; ++i) {
    const auto value = [&](const Eigen::VectorXd& step) {
      Eigen::MatrixXd z = latents;
      z.col(i) += step;
      return objective.Evaluate(run(z)[i]);
    };
    EXPECT_LT(RelativeError(gradient.latents.col(i), NumericGradient(value, 8 * kSteps)), 1e-5)
        << "body " << i;
  }
}

}  // namespace
}  // namespace holdfast
