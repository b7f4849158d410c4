// SPDX-License-Identifier: MIT
#include "generator/training/wandr/unrolled_batch.h"

#include <gtest/gtest.h>

#include "tests/support/training_scene.h"

namespace holdfast::wandr {
namespace {

using testing::ComposedClip;

constexpr int kSteps = 4;

// A stand-in for the network: deltas are M c + offset. Single precision all the way, as in
// training: gradients are checked along directions, where finite differences have digits to spare.
struct LinearNetwork {
  Eigen::MatrixXf matrix, offset;

  explicit LinearNetwork(int condition) {
    nn::RandomStream random(5);
    matrix = Eigen::MatrixXf::NullaryExpr(
        kStateSize, condition, [&] { return 0.03f * static_cast<float>(random.Uniform() - 0.5); });
    offset = Eigen::MatrixXf::NullaryExpr(
        kStateSize, 1, [&] { return 0.4f * static_cast<float>(random.Uniform() - 0.5); });
  }
};

class UnrolledBatchTest : public ::testing::Test {
 protected:
  UnrolledBatchTest()
      : clips_{ComposedClip(0, true), ComposedClip(1, true), ComposedClip(2, false)},
        batch_(testing::WalkingStatistics(), testing::DefaultBones().Cast<float>(),
               IntentionLayout::kBounded, {}, 3, kSteps) {}

  // Followed windows begin a little perturbed.
  std::vector<TrainingWindow> Windows(bool free) const {
    std::vector<TrainingWindow> windows;
    for (const CorpusClip& clip : clips_) {
      TrainingWindow window;
      window.truth = clip.poses.data() + 10;
      window.before = window.truth - 1;
      for (const Waypoint& goal : clip.goals) {
        window.plan.push_back({goal.position, goal.frame - 10});
      }
      if (free) window.plan = {{Eigen::Vector3d(0.3, -0.5, 1.0), 3}};
      window.free = free;
      window.perturbation.setConstant(free ? 0.0f : 0.04f);
      windows.push_back(window);
    }
    return windows;
  }

  // The loss of the whole; with `gradient`, that of the matrix too.
  double Loss(const LinearNetwork& network, bool free, Eigen::MatrixXf* gradient) {
    batch_.Begin(Windows(free), kSteps);
    const Eigen::VectorXf weights = Eigen::VectorXf::Constant(3, 1.0f / 3.0f);
    const FootHeights standing{0.08f, 0.02f};
    std::vector<Eigen::MatrixXf> conditions;
    Eigen::MatrixXf targets(kStateSize, 3);
    double loss = 0.0;
    for (int a = 0; a < kSteps; ++a) {
      Eigen::MatrixXf& c = conditions.emplace_back(batch_.ConditionSize(), 3);
      batch_.WriteInputs(a, c, targets, 1);
      const Eigen::MatrixXf u = network.matrix * c + network.offset.replicate(1, 3);
      loss += batch_.Advance(a, u, JointLossWeights(), weights, 1);
    }
    if (free) loss += batch_.JudgeByGoals(GoalLossWeights(), standing, 1.0f / 3.0f, 1);
    if (!gradient) return loss;
    gradient->setZero(network.matrix.rows(), network.matrix.cols());
    Eigen::MatrixXf u_bar(kStateSize, 3);
    for (int a = kSteps - 1; a >= 0; --a) {
      batch_.OutputGradient(a, u_bar, 1);
      *gradient += u_bar * conditions[a].transpose();
      if (a > 0) {
        const Eigen::MatrixXf c_bar = network.matrix.transpose() * u_bar;
        batch_.ConditionGradient(a, c_bar, std::numeric_limits<float>::infinity(), 1);
      }
    }
    return loss;
  }

  void CheckGradient(bool free) {
    LinearNetwork network(batch_.ConditionSize());
    Eigen::MatrixXf gradient;
    const double loss = Loss(network, free, &gradient);
    ASSERT_GT(loss, 0.0);
    // Along the gradient itself, and along random directions against their own size.
    nn::RandomStream random(9);
    for (int trial = 0; trial < 6; ++trial) {
      Eigen::MatrixXf direction = gradient;
      if (trial > 0) {
        direction = Eigen::MatrixXf::NullaryExpr(gradient.rows(), gradient.cols(), [&] {
          return static_cast<float>(random.Uniform() - 0.5);
        });
      }
      direction /= direction.norm();
      const float h = 2e-3f;
      LinearNetwork plus = network, minus = network;
      plus.matrix += h * direction;
      minus.matrix -= h * direction;
      const double numeric =
          (Loss(plus, free, nullptr) - Loss(minus, free, nullptr)) / (2.0 * static_cast<double>(h));
      const double analytic = gradient.cwiseProduct(direction).sum();
      EXPECT_NEAR(analytic, numeric, 0.01 * gradient.norm()) << "direction " << trial;
    }
  }

  std::vector<CorpusClip> clips_;
  UnrolledBatch batch_;
};

TEST_F(UnrolledBatchTest, GradientOfFollowedWindowsAgreesWithDifferences) { CheckGradient(false); }

TEST_F(UnrolledBatchTest, GradientOfFreeWindowsAgreesWithDifferences) { CheckGradient(true); }

// The corrective delta of the first step is the true one, and applying it gives the true pose.
TEST_F(UnrolledBatchTest, TargetsCarryBodiesToTheTruth) {
  batch_.Begin(Windows(false), kSteps);
  Eigen::MatrixXf conditions(batch_.ConditionSize(), 3), targets(kStateSize, 3);
  const Eigen::VectorXf weights = Eigen::VectorXf::Ones(3);
  for (int a = 0; a < kSteps; ++a) {
    batch_.WriteInputs(a, conditions, targets, 1);
    // A wrong step first: the target of the next one must make up for it.
    Eigen::MatrixXf u = targets;
    if (a == 0) u.array() += 0.5f;
    batch_.Advance(a, u, JointLossWeights(), weights, 1);
    for (int i = 0; i < 3 && a > 0; ++i) {
      const Pose<float>& truth = batch_.TruthAt(i, a + 1);
      EXPECT_LT((StateOf(batch_.PoseAt(i, a + 1)) - StateOf(truth)).cwiseAbs().maxCoeff(), 2e-4f);
    }
  }
}

// Perturbed starts are blended back to the data.
TEST_F(UnrolledBatchTest, TheTruthLeadsBack) {
  batch_.Begin(Windows(false), kSteps);
  double before = INFINITY;
  for (int a = 0; a <= kSteps; ++a) {
    const Pose<float>& truth = clips_[1].poses[10 + a];
    const double off = (StateOf(batch_.TruthAt(1, a)) - StateOf(truth)).norm();
    EXPECT_LT(off, 0.95 * before);
    EXPECT_GT(off, 1e-3);
    before = off;
  }
}

// Conditions are those that a rollout of the same network would see.
TEST_F(UnrolledBatchTest, ConditionsAreThoseOfTrainingFrames) {
  const CorpusClip& clip = clips_[0];
  MotionFrames motion;
  BodyKinematics<double> kinematics;
  for (const Pose<float>& pose : clip.poses) {
    motion.poses.push_back(pose.Cast<double>());
    ForwardKinematics(testing::DefaultBones(), motion.poses.back(), kinematics);
    motion.joints.push_back(kinematics.joints);
  }
  const Normalizer<double> norms(testing::WalkingStatistics());
  const TrainingFrames frames = MakeTrainingFrames(motion, std::vector<int>(clip.poses.size(), 0),
                                                   IntentionLayout::kBounded, norms, Side::kRight);
  std::vector<TrainingWindow> windows = Windows(false);
  windows[0].plan.clear();
  windows[0].perturbation.setZero();
  batch_.Begin(windows, kSteps);
  Eigen::MatrixXf conditions(batch_.ConditionSize(), 3), targets(kStateSize, 3);
  batch_.WriteInputs(0, conditions, targets, 1);
  EXPECT_LT((conditions.col(0) - frames.conditions.col(10)).cwiseAbs().maxCoeff(), 2e-3f);
  EXPECT_LT((targets.col(0) - frames.targets.col(10)).cwiseAbs().maxCoeff(), 2e-3f);
}

TEST(GoalLoss, GradientAgreesWithDifferences) {
  nn::RandomStream random(3);
  std::vector<BodyJoints<float>> joints(30), bars(30);
  for (BodyJoints<float>& frame : joints) {
    frame = BodyJoints<float>::NullaryExpr(
        [&] { return 0.25f * static_cast<float>(random.Uniform()); });
  }
  for (auto& bar : bars) bar.setZero();
  const FootHeights standing{0.08f, 0.02f};
  const auto loss = [&](const std::vector<BodyJoints<float>>& at,
                        std::vector<BodyJoints<float>>& out) {
    return AddGoalLoss(at, {0.4f, 0.2f, 0.3f}, 25, 21, standing, GoalLossWeights(), 2.0f, out);
  };
  loss(joints, bars);
  double norm = 0.0;
  for (const auto& bar : bars) norm += static_cast<double>(bar.squaredNorm());
  norm = std::sqrt(norm);
  ASSERT_GT(norm, 0.0);
  auto scratch = bars;
  const float h = 2e-4f;
  auto plus = joints, minus = joints;
  for (std::size_t t = 0; t < joints.size(); ++t) {
    plus[t] += h * bars[t] / static_cast<float>(norm);
    minus[t] -= h * bars[t] / static_cast<float>(norm);
  }
  const double numeric =
      (loss(plus, scratch) - loss(minus, scratch)) / (2.0 * static_cast<double>(h));
  // The soft minimum's weights count as constant: the difference that makes is small, not nothing.
  EXPECT_NEAR(norm / 2.0, numeric, 0.05 * norm);
}

}  // namespace
}  // namespace holdfast::wandr
