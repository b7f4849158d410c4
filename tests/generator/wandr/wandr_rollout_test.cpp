// SPDX-License-Identifier: MIT
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "generator/wandr/pose.h"
#include "geometry/error.h"
#include "tests/support/allocation_count.h"
#include "tests/support/wandr_scene.h"

namespace holdfast::wandr {
namespace {

using testing::DefaultBones;
using testing::NumericGradient;
using testing::Perturbed;
using testing::RandomStart;
using testing::RelativeError;
using testing::SmallNetwork;
using testing::WithScaledOutput;

constexpr int kRolloutSteps = 9;

// A scene for derivatives: bodies with two goals, one, and none.
struct Scene {
  explicit Scene(IntentionLayout layout, bool hold_last_goal = false)
      : Scene(SmallNetwork(layout, 3), hold_last_goal) {}
  explicit Scene(const NetworkWeights& from, bool hold_last_goal = false)
      : weights(from), network(weights) {
    intention.hold_last_goal = hold_last_goal;
    nn::RandomStream random(11);
    for (int i = 0; i < 3; ++i) starts.push_back(RandomStart(random));
    plans = {{{{1.5, 1.0, 1.1}, 4}, {{-1.0, 0.5, 0.3}, 20}}, {{{0.3, -2.0, 1.6}, 6}}, {}};
    latents = Eigen::MatrixXd::NullaryExpr(8 * kRolloutSteps, 3,
                                           [&] { return 2.0 * random.Uniform() - 1.0; });
    joint_weights.resize(kRolloutSteps + 1);
    pose_weights.resize(kRolloutSteps + 1);
    for (const int t : {0, 5, kRolloutSteps}) {
      joint_weights[t] = Eigen::MatrixXd::NullaryExpr(kJointNumbers, 3,
                                                      [&] { return 2.0 * random.Uniform() - 1.0; });
    }
  }

  Rollout<double> Run(const std::vector<RolloutStart<double>>& from,
                      const std::vector<GoalPlan>& to, const Eigen::MatrixXd& z) const {
    Rollout<double> rollout(network, DefaultBones(), 3, kRolloutSteps, intention, true);
    rollout.Begin(from, to);
    for (int t = 0; t < kRolloutSteps; ++t) rollout.Step(z.middleRows(8 * t, 8));
    return rollout;
  }
  // sum over frames of weights . joints, for body i.
  double Value(const Rollout<double>& rollout, int i) const {
    double sum = 0.0;
    for (int t = 0; t <= kRolloutSteps; ++t) {
      if (joint_weights[t].size() == 0) continue;
      BodyKinematics<double> kinematics;
      ForwardKinematics(DefaultBones(), rollout.Poses(t)[i], kinematics);
      sum += joint_weights[t].col(i).dot(
          Eigen::Map<const Eigen::VectorXd>(kinematics.joints.data(), kJointNumbers));
    }
    return sum;
  }

  NetworkWeights weights;
  Network<double> network;
  IntentionOptions intention;
  std::vector<RolloutStart<double>> starts;
  std::vector<GoalPlan> plans;
  Eigen::MatrixXd latents;
  std::vector<Eigen::MatrixXd> joint_weights, pose_weights;
};

void CheckGradients(const Scene& scene) {
  const Rollout<double> rollout = scene.Run(scene.starts, scene.plans, scene.latents);
  RolloutGradient<double> gradient;
  rollout.Backward({scene.joint_weights, {}}, 1, gradient);
  for (int i = 0; i < 3; ++i) {
    SCOPED_TRACE("body " + std::to_string(i));
    const auto latents = [&](const Eigen::VectorXd& step) {
      Eigen::MatrixXd z = scene.latents;
      z.col(i) += step;
      return scene.Value(scene.Run(scene.starts, scene.plans, z), i);
    };
    EXPECT_LT(RelativeError(gradient.latents.col(i), NumericGradient(latents, 8 * kRolloutSteps)),
              1e-5);
    const auto pose = [&](const Eigen::VectorXd& step) {
      std::vector<RolloutStart<double>> starts = scene.starts;
      starts[i].pose = Perturbed(starts[i].pose, step);
      return scene.Value(scene.Run(starts, scene.plans, scene.latents), i);
    };
    EXPECT_LT(RelativeError(gradient.start_pose.col(i), NumericGradient(pose, kTangentSize)), 1e-5);
    const auto delta = [&](const Eigen::VectorXd& step) {
      std::vector<RolloutStart<double>> starts = scene.starts;
      starts[i].previous_delta += step;
      return scene.Value(scene.Run(starts, scene.plans, scene.latents), i);
    };
    EXPECT_LT(RelativeError(gradient.previous_delta.col(i), NumericGradient(delta, kStateSize)),
              1e-5);
    for (std::size_t w = 0; w < scene.plans[i].size(); ++w) {
      const auto goal = [&](const Eigen::VectorXd& step) {
        std::vector<GoalPlan> plans = scene.plans;
        plans[i][w].position += step;
        return scene.Value(scene.Run(scene.starts, plans, scene.latents), i);
      };
      EXPECT_LT(RelativeError(gradient.goals.block<3, 1>(3 * w, i), NumericGradient(goal, 3)),
                1e-5);
    }
  }
  EXPECT_EQ(gradient.goals.col(2), Eigen::VectorXd::Zero(6)) << "no goal, no gradient";
}

TEST(Rollout, GradientIsTheDerivativeInEverything) {
  for (const IntentionLayout layout :
       {IntentionLayout::kPaper, IntentionLayout::kFlagged, IntentionLayout::kBounded}) {
    CheckGradients(Scene(layout, layout == IntentionLayout::kBounded));
  }
}

TEST(Rollout, GradientOfAResidualDecoderIsTheDerivative) {
  CheckGradients(Scene(testing::SmallResidualNetwork(IntentionLayout::kFlagged, 3)));
}

TEST(Rollout, RowsOfAResidualAreGradientsOfTheirOwn) {
  const Scene scene(IntentionLayout::kPaper);
  const Rollout<double> rollout = scene.Run(scene.starts, scene.plans, scene.latents);
  RolloutSeed<double> seed;
  seed.joints.resize(kRolloutSteps + 1);
  seed.joints[kRolloutSteps] = Eigen::MatrixXd::Zero(kJointNumbers, 9);
  for (int c = 0; c < 9; ++c) seed.joints[kRolloutSteps](3 * 21 + c % 3, c) = 1.0;
  RolloutGradient<double> together, alone;
  rollout.Backward(seed, 3, together);
  for (int row = 0; row < 3; ++row) {
    RolloutSeed<double> one;
    one.joints.resize(kRolloutSteps + 1);
    one.joints[kRolloutSteps] = Eigen::MatrixXd::Zero(kJointNumbers, 3);
    one.joints[kRolloutSteps].row(3 * 21 + row).setOnes();
    rollout.Backward(one, 1, alone);
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(together.latents.col(3 * i + row), alone.latents.col(i));
      EXPECT_EQ(together.start_pose.col(3 * i + row), alone.start_pose.col(i));
    }
  }
}

TEST(Rollout, SeedsOnPosesCount) {
  const Scene scene(IntentionLayout::kPaper);
  const Rollout<double> rollout = scene.Run(scene.starts, scene.plans, scene.latents);
  RolloutSeed<double> seed;
  seed.poses.resize(kRolloutSteps + 1);
  seed.poses[0] = seed.poses[kRolloutSteps] = Eigen::MatrixXd::Zero(kTangentSize, 3);
  seed.poses[0](5, 1) = 2.0;
  seed.poses[kRolloutSteps](1, 1) = 1.0;
  RolloutGradient<double> gradient;
  rollout.Backward(seed, 1, gradient);
  const auto pose = [&](const Eigen::VectorXd& step) {
    std::vector<RolloutStart<double>> starts = scene.starts;
    starts[1].pose = Perturbed(starts[1].pose, step);
    return scene.Run(starts, scene.plans, scene.latents).Poses(kRolloutSteps)[1].translation.y() +
           2.0 * step[5];
  };
  EXPECT_LT(RelativeError(gradient.start_pose.col(1), NumericGradient(pose, kTangentSize)), 1e-5);
}

// The published sizes, float, for the laws of running.
struct PublishedScene {
  explicit PublishedScene(int count)
      : PublishedScene(count,
                       RandomNetwork(IntentionLayout::kPaper, 1, testing::WalkingStatistics())) {}
  PublishedScene(int count, const NetworkWeights& from)
      : weights(from), network(weights), bones(DefaultBones().Cast<float>()) {
    nn::RandomStream random(5);
    for (int i = 0; i < count; ++i) {
      starts.push_back(RandomStart(random).Cast<float>());
      plans.push_back({{Eigen::Vector3d(i % 5 - 2.0, i % 3, 0.2 * (i % 8)), 60}});
    }
  }
  RolloutRequest Request(int steps) const {
    return {.starts = starts, .plans = plans, .num_steps = steps, .seed = 9};
  }

  NetworkWeights weights;
  Network<float> network;
  BoneOffsets<float> bones;
  std::vector<RolloutStart<float>> starts;
  std::vector<GoalPlan> plans;
};

// The laws hold for both architectures.
class EveryDecoder : public ::testing::TestWithParam<const char*> {
 protected:
  static PublishedScene SceneOf(int count) {
    if (GetParam() == std::string("Chain")) return PublishedScene(count);
    return {count, RandomResidualNetwork(IntentionLayout::kPaper, 1, testing::WalkingStatistics(),
                                         kLatentSize, 256, 4)};
  }
};
INSTANTIATE_TEST_SUITE_P(Rollout, EveryDecoder, ::testing::Values("Chain", "Residual"),
                         [](const auto& of) { return std::string(of.param); });

TEST(Rollout, StepsAsThePaperComposesThem) {
  // One step from the parts, each tested on its own: condition, decoder, step.
  const PublishedScene scene(1);
  const Network<double> network(scene.weights);
  nn::RandomStream random(21);
  const RolloutStart<double> start = RandomStart(random);
  const Eigen::VectorXd z = Eigen::VectorXd::Random(kLatentSize);
  const std::vector<GoalPlan> plans{{{{1.0, 2.0, 1.2}, 30}}};

  Eigen::VectorXd condition(277);
  const Heading<double> heading = HeadingOf<double>(start.pose.rotation[0]);
  WritePoseFeatures(start.pose, heading, network.Norms(), condition.data());
  condition.segment<kStateSize>(kPreviousDeltaOf) = start.previous_delta;
  BodyKinematics<double> kinematics;
  ForwardKinematics(DefaultBones(), start.pose, kinematics);
  const FrameGoal<double> goal{true, {1.0, 2.0, 1.2}, 30.0, {}};
  WriteIntention<double>(IntentionLayout::kPaper,
                         {heading, kinematics.joints.col(0), kinematics.joints.col(21)}, goal,
                         condition.data() + kIntentionOf);
  nn::Tape<double> tape(network.Decoder(), 1);
  tape.Input() << z, condition;
  network.Decoder().Forward(tape);
  const StateVector<double> u = tape.Output();
  const StateVector<double> delta = DeltaOfNormalized<double>(network.Norms(), u);
  Pose<double> expected;
  ApplyDelta<double>(start.pose, heading, delta, expected);

  Rollout<double> rollout(network, DefaultBones(), 1, 1);
  rollout.Begin({&start, 1}, plans);
  rollout.Step(z);
  EXPECT_LT((StateOf(rollout.Poses(1)[0]) - StateOf(expected)).norm(), 1e-13);
  EXPECT_LT((rollout.PreviousDelta().col(0) - u).norm(), 1e-13);
}

TEST_P(EveryDecoder, DoesNotDependOnThreadsOrCompany) {
  const PublishedScene scene = SceneOf(101);
  const auto all = RunRollouts(scene.network, scene.bones, scene.Request(12), 1);
  const auto threaded = RunRollouts(scene.network, scene.bones, scene.Request(12), 3);
  for (int i = 0; i < 101; ++i) {
    ASSERT_EQ(all[i].states, threaded[i].states);
    ASSERT_EQ(all[i].joints, threaded[i].joints);
  }
  for (const int i : {0, 47, 48, 100}) {
    RolloutRequest one = scene.Request(12);
    one.starts = one.starts.subspan(i, 1);
    one.plans = one.plans.subspan(i, 1);
    one.first_stream = i;
    EXPECT_EQ(RunRollouts(scene.network, scene.bones, one, 1)[0].states, all[i].states);
    Eigen::MatrixXf z = DrawLatents(9, i, kLatentSize, 12, 1.0);
    one.latents = &z;
    EXPECT_EQ(RunRollouts(scene.network, scene.bones, one, 1)[0].states, all[i].states);
  }
  EXPECT_NE(all[0].states, all[5].states);
}

TEST_P(EveryDecoder, FloatIsDoubleToRounding) {
  const PublishedScene scene = SceneOf(4);
  const Network<double> network(scene.weights);
  for (int i = 0; i < 4; ++i) {
    RolloutStart<double> start = scene.starts[i].Cast<double>();
    const Eigen::VectorXf z = DrawLatents(9, i, kLatentSize, 30, 1.0);
    for (int t = 0; t < 30; ++t) {  // each step on its own, from where double is
      const GoalPlan plan{{scene.plans[i][0].position, 60 - t}};
      const RolloutStart<float> same = start.Cast<float>();
      Rollout<double> exact(network, DefaultBones(), 1, 1);
      Rollout<float> rollout(scene.network, scene.bones, 1, 1);
      exact.Begin({&start, 1}, {&plan, 1});
      rollout.Begin({&same, 1}, {&plan, 1});
      exact.Step(z.segment(kLatentSize * t, kLatentSize).cast<double>());
      rollout.Step(z.segment(kLatentSize * t, kLatentSize));
      EXPECT_LT((StateOf(rollout.Poses(1)[0]).cast<double>() - StateOf(exact.Poses(1)[0]))
                    .cwiseAbs()
                    .maxCoeff(),
                2e-6);
      start = {exact.Poses(1)[0], exact.PreviousDelta().col(0)};
    }
  }
}

TEST_P(EveryDecoder, EightSecondsInFloatEndWhereDoubleEnds) {
  const PublishedScene scene = SceneOf(4);
  const NetworkWeights weights = WithScaledOutput(scene.weights, 0.05f);
  const Network<float> single(weights);
  const Network<double> network(weights);
  RolloutRequest request = scene.Request(240);
  const std::vector<GoalPlan> plans(4, GoalPlan{{{2.0, 1.0, 1.0}, 240}});
  request.plans = plans;
  const auto tracks = RunRollouts(single, scene.bones, request, 1);
  for (int i = 0; i < 4; ++i) {
    const RolloutStart<double> start = scene.starts[i].Cast<double>();
    const Eigen::VectorXd z = DrawLatents(9, i, kLatentSize, 240, 1.0).cast<double>();
    Rollout<double> rollout(network, DefaultBones(), 1, 240);
    rollout.Begin({&start, 1}, {&plans[i], 1});
    for (int t = 0; t < 240; ++t) rollout.Step(z.segment(kLatentSize * t, kLatentSize));
    EXPECT_LT((tracks[i].states.col(240).cast<double>() - StateOf(rollout.Poses(240)[0]))
                  .cwiseAbs()
                  .maxCoeff(),
              1e-3);
    // Rotations are still rotations.
    const Eigen::Vector3f first = tracks[i].states.block<3, 1>(3, 240),
                          second = tracks[i].states.block<3, 1>(6, 240);
    EXPECT_NEAR(first.norm(), 1.0, 1e-6);
    EXPECT_NEAR(first.dot(second), 0.0, 1e-6);
  }
}

TEST(Rollout, CommutesWithMovingOnTheGround) {
  const Scene scene(IntentionLayout::kPaper);
  const Eigen::Vector3d pelvis = testing::DefaultBody().rest_joints.col(0), by(2.0, -1.0, 0.0);
  const double turn = 2.5;
  std::vector<RolloutStart<double>> starts = scene.starts;
  std::vector<GoalPlan> plans = scene.plans;
  for (RolloutStart<double>& start : starts) start.pose = Moved(start.pose, turn, by, pelvis);
  for (GoalPlan& plan : plans) {
    for (Waypoint& w : plan) {
      w.position = ExpSO3(turn * Eigen::Vector3d::UnitZ()) * w.position + by;
    }
  }
  const Rollout<double> here = scene.Run(scene.starts, scene.plans, scene.latents);
  const Rollout<double> there = scene.Run(starts, plans, scene.latents);
  for (int i = 0; i < 3; ++i) {
    const Pose<double> moved = Moved(here.Poses(kRolloutSteps)[i], turn, by, pelvis);
    EXPECT_LT((StateOf(there.Poses(kRolloutSteps)[i]) - StateOf(moved)).norm(), 1e-9);
  }
}

TEST_P(EveryDecoder, StepsAllocateNothing) {
#if !defined(HOLDFAST_COUNTS_ALLOCATIONS)
  GTEST_SKIP() << "allocations are not counted in this build";
#endif
  const PublishedScene scene = SceneOf(7);
  for (const bool differentiable : {false, true}) {
    Rollout<float> rollout(scene.network, scene.bones, 7, 20, {}, differentiable);
    const Eigen::MatrixXf z = Eigen::MatrixXf::Random(kLatentSize, 7);
    rollout.Begin(scene.starts, scene.plans);
    const long before = holdfast::testing::AllocationCount();
    for (int t = 0; t < 20; ++t) rollout.Step(z);
    EXPECT_EQ(holdfast::testing::AllocationCount(), before);
    rollout.Begin(scene.starts, scene.plans);
    EXPECT_EQ(holdfast::testing::AllocationCount(), before) << "nor does starting again";
  }
  const nn::ColumnNetwork<float>& decoder = scene.network.Decoder();
  nn::Tape<float> tape(decoder, 3);
  nn::Scratch<float> scratch(decoder, 6);
  tape.Input().setRandom();
  const Eigen::MatrixXf rows = Eigen::MatrixXf::Random(decoder.OutputSize(), 6);
  Eigen::MatrixXf gradient(decoder.InputSize(), 6);
  const long started = holdfast::testing::AllocationCount();
  decoder.Forward(tape);
  decoder.Backward(tape, rows, gradient, scratch);
  EXPECT_EQ(holdfast::testing::AllocationCount(), started) << "backwards neither";
  // The counter counts.
  const long before = holdfast::testing::AllocationCount();
  const std::vector<int> some(100);
  const Eigen::VectorXf more(50);
  EXPECT_EQ(holdfast::testing::AllocationCount(), before + 2);
}

TEST(Rollout, RefusesBadRequests) {
  PublishedScene scene(2);
  const auto run = [&](const RolloutRequest& request) {
    return RunRollouts(scene.network, scene.bones, request, 1);
  };
  RolloutRequest request = scene.Request(3);
  EXPECT_NO_THROW(run(request));
  request.num_steps = 0;
  EXPECT_THROW(run(request), Error);
  request = scene.Request(3);
  request.plans = request.plans.first(1);
  EXPECT_THROW(run(request), Error);
  const Eigen::MatrixXf short_latents = Eigen::MatrixXf::Zero(64, 2);
  request = scene.Request(3);
  request.latents = &short_latents;
  EXPECT_THROW(run(request), Error);
  scene.plans[1][0].position.x() = NAN;
  EXPECT_THROW(run(scene.Request(3)), Error);
  EXPECT_THROW(run({}), Error);
}

TEST(Rollout, ALateDeadlineIsToldAsTheTimeToWalkThere) {
  Scene scene(IntentionLayout::kBounded);
  const Eigen::Vector3d goal(0.8, 1.0, 1.2);
  const Eigen::Vector3d pelvis = scene.starts[0].pose.translation + DefaultBones().offset.col(0);
  const double way = (goal - pelvis).head<2>().norm();
  const auto first_step = [&](int deadline) {
    scene.plans[0] = {{goal, deadline}};
    return scene.Run(scene.starts, scene.plans, scene.latents).Poses(1)[0].rotation[14];
  };
  const Eigen::Matrix3d due = first_step(60), late = first_step(1000), soon = first_step(30);
  EXPECT_GT((late - due).norm(), 1e-6);
  scene.intention.pace_m_s = 30.0 * way / 60.0;
  EXPECT_LT((first_step(1000) - due).norm(), 1e-12);
  EXPECT_EQ(first_step(30), soon);
}

TEST(GoalPlan, TheNextDeadlineCounts) {
  const GoalPlan plan{{{1, 0, 0}, 10}, {{2, 0, 0}, 25}};
  IntentionOptions options;
  EXPECT_EQ(ActiveWaypoint(plan, 0, options), 0);
  EXPECT_EQ(ActiveWaypoint(plan, 9, options), 0);
  EXPECT_EQ(ActiveWaypoint(plan, 10, options), 1);
  EXPECT_EQ(ActiveWaypoint(plan, 25, options), -1);
  EXPECT_EQ(GoalAt<double>(plan, 0, options).frames_left, 10.0);
  EXPECT_EQ(GoalAt<double>(plan, 24, options).frames_left, 1.0);
  EXPECT_FALSE(GoalAt<double>(plan, 30, options).active);
  options.hold_last_goal = true;
  options.min_frames_left = 5.0;
  EXPECT_EQ(GoalAt<double>(plan, 8, options).frames_left, 5.0);
  EXPECT_EQ(GoalAt<double>(plan, 300, options).frames_left, 5.0);
  EXPECT_EQ(GoalAt<double>(plan, 300, options).position.x(), 2.0);
  EXPECT_FALSE(GoalAt<double>({}, 0, options).active);
  EXPECT_EQ(DeadlineRule().Frames(0.0), 42);
  EXPECT_EQ(DeadlineRule().Frames(2.0), 105);
  EXPECT_EQ(DeadlineRule().Frames(9.0), 240);
}

}  // namespace
}  // namespace holdfast::wandr
