// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "generator/imos/synthesis_network.h"
#include "geometry/error.h"
#include "geometry/rotation.h"
#include "tests/support/imos_scene.h"
#include "tests/support/wandr_scene.h"
#define HOLDFAST_ALLOCATIONS_ARE_COUNTED_ELSEWHERE  // wandr_rollout_test.cpp
#include "tests/support/allocation_count.h"

namespace holdfast::imos {
namespace {

using testing::DrawnNetwork;
using testing::Given;
using testing::RandomGiven;
using testing::Roll;

struct Named {
  const char* name;
  Config config;
};

std::vector<Named> AllKinds() {
  std::vector<Named> kinds{{"compact", testing::SmallConfig()}};
  Config published = testing::SmallConfig();
  published.arms_see_class = false;
  published.arms_see_object_pose = false;
  published.object_now = ObjectInput::kTrue;
  published.arm_order = ArmOrder::kRightThenLeft;
  published.predicts_root = false;
  published.keeps_past_poses = false;
  published.sees_progress = false;
  kinds.push_back({"published", published});
  Config one = testing::SmallConfig();
  one.has_arms = false;
  kinds.push_back({"one module", one});
  Config plain = testing::SmallConfig();
  plain.self_attention = false;
  plain.body_sees_arms_now = false;
  plain.object_now = ObjectInput::kAbsent;
  kinds.push_back({"no attention", plain});
  return kinds;
}

TEST(ImosRollout, ASampleDoesNotDependOnTheOthers) {
  constexpr int kSamples = 9, kFrames = 8;
  for (const auto& [name, config] : AllKinds()) {
    SCOPED_TRACE(name);
    const Network<float> network(DrawnNetwork(config, 18));
    const Given<float> given = RandomGiven(config, kSamples, kFrames, 19).Cast<float>();
    Rollout<float> all(network, kSamples, kFrames);
    Roll(all, given, config.NoiseSize());
    Rollout<float> one(network, kSamples, kFrames);  // with room to spare
    for (const int i : {0, 4, 8}) {
      Given<float> own;
      own.conditions = given.conditions.col(i);
      own.noise = given.noise.col(i);
      for (const auto& f : given.history) {
        own.history.push_back({f.pose.col(i), f.root.col(i), f.object.col(i), {}});
      }
      for (const auto& object : given.objects) own.objects.push_back(object.col(i));
      Roll(one, own, config.NoiseSize());
      for (int f = 0; f < kFrames; ++f) {
        EXPECT_EQ(one.Frame(f).pose.col(0), all.Frame(f).pose.col(i)) << "frame " << f;
        EXPECT_EQ(one.Frame(f).root.col(0), all.Frame(f).root.col(i)) << "frame " << f;
      }
    }
  }
}

TEST(ImosRollout, StepsAllocateNothing) {
#if !defined(HOLDFAST_COUNTS_ALLOCATIONS)
  GTEST_SKIP() << "allocations are not counted in this build";
#endif
  constexpr int kSamples = 5, kFrames = 10;
  for (const auto& [name, config] : AllKinds()) {
    SCOPED_TRACE(name);
    const Network<float> network(DrawnNetwork(config, 20));
    const Given<float> given = RandomGiven(config, kSamples, kFrames, 21).Cast<float>();
    Rollout<float> rollout(network, kSamples, kFrames);
    const long before = holdfast::testing::AllocationCount();
    Roll(rollout, given, config.NoiseSize());
    Roll(rollout, given, config.NoiseSize());
    EXPECT_EQ(holdfast::testing::AllocationCount(), before);
  }
  const long before = holdfast::testing::AllocationCount();
  const Eigen::VectorXf some(50);
  EXPECT_EQ(holdfast::testing::AllocationCount(), before + 1) << "the counter counts";
}

// What is fed back is raw: with poses made orthonormal between steps the motion is another.
TEST(ImosRollout, FeedsBackWhatTheNetworksGave) {
  Config config = testing::SmallConfig();
  config.sees_progress = false;  // of the second rollout it is another
  const Network<double> network(DrawnNetwork(config, 22));
  const Given<double> given = RandomGiven(config, 1, 6, 23);
  Rollout<double> rollout(network, 1, 6);
  Roll(rollout, given, config.NoiseSize());
  // One step from frames 1..4 of the first rollout, as they are.
  Given<double> later = given;
  for (int f = 0; f < kHistory; ++f) {
    later.history[f] = {
        rollout.Frame(f + 1).pose, rollout.Frame(f + 1).root, rollout.Frame(f + 1).object, {}};
  }
  later.objects.assign(given.objects.begin() + 1, given.objects.end());
  later.noise = given.noise.bottomRows(config.NoiseSize());
  Rollout<double> again(network, 1, 6);
  Roll(again, later, config.NoiseSize());
  EXPECT_EQ(again.Frame(4).pose, rollout.Frame(5).pose);
}

SynthesisStart StartFor(const Config& config, nn::RandomStream& random) {
  SynthesisStart start;
  for (int f = 0; f < kHistory; ++f) {
    const wandr::Pose<double> pose = wandr::testing::RandomPose(random);
    start.poses.col(f) = PoseColumn(pose);
    start.roots.col(f) = pose.translation;
    start.objects.col(f) =
        ObjectColumn(pose.rotation[21], pose.translation, config.object_rotation);
  }
  const Eigen::VectorXd betas = Eigen::VectorXd::Constant(16, 0.3);
  start.condition =
      ConditionOf(betas, {3, 1}, Eigen::MatrixXf::Random(kNumActions, config.action_size));
  return start;
}

struct Scene {
  explicit Scene(const Config& of, int count) : config(of) {
    nn::RandomStream random(24);
    std::srand(1);
    for (int i = 0; i < count; ++i) starts.push_back(StartFor(config, random));
  }
  Config config;
  Network<float> network{DrawnNetwork(config, 25)};
  std::vector<SynthesisStart> starts;
  // In the right hand, so that the loop is closed.
  ObjectOfFrame in_hand = [this](int, int, const wandr::Pose<double>& pose) {
    return ObjectColumn(pose.rotation[21], pose.translation, config.object_rotation);
  };
};

TEST(RunSynthesis, DoesNotDependOnThreadsOrCompany) {
  const Scene scene(testing::SmallConfig(), 70);
  const SynthesisRequest request{.starts = scene.starts, .seed = 4};
  const auto one = RunSynthesis(scene.network, request, scene.in_hand, 1),
             three = RunSynthesis(scene.network, request, scene.in_hand, 3);
  ASSERT_EQ(one.size(), 70u);
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].raw_poses, three[i].raw_poses) << i;
    EXPECT_EQ(one[i].roots, three[i].roots) << i;
    EXPECT_EQ(one[i].objects, three[i].objects) << i;
  }
  const SynthesisRequest part{
      .starts = std::span(scene.starts).subspan(40, 3), .seed = 4, .first_stream = 40};
  const auto some = RunSynthesis(scene.network, part, scene.in_hand, 1);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(some[i].raw_poses, one[40 + i].raw_poses);
  const SynthesisRequest other{.starts = scene.starts, .seed = 5};
  EXPECT_NE(RunSynthesis(scene.network, other, scene.in_hand, 1)[0].poses, one[0].poses);
}

TEST(RunSynthesis, PosesAreRotationsAndWhatTheCallbackSaw) {
  const Scene scene(testing::SmallConfig(), 2);
  const SynthesisRequest request{.starts = scene.starts, .num_frames = 9};
  int calls = 0;
  std::vector<wandr::Pose<double>> seen;
  const auto tracks = RunSynthesis(
      scene.network, request,
      [&](int sample, int frame, const wandr::Pose<double>& pose) {
        EXPECT_EQ(frame, kHistory + calls / 2);
        EXPECT_EQ(sample, calls % 2);
        ++calls;
        if (sample == 1) seen.push_back(pose);
        return scene.in_hand(sample, frame, pose);
      },
      1);
  EXPECT_EQ(calls, 10);
  for (int f = 0; f < 9; ++f) {
    const wandr::Pose<double> pose = tracks[1].Pose(f);
    for (const Eigen::Matrix3d& R : pose.rotation) {
      EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(), 1e-12);
      EXPECT_GT(R.determinant(), 0.0);
    }
    if (f < kHistory) {
      EXPECT_LT((tracks[1].poses.col(f) - scene.starts[1].poses.col(f)).norm(), 1e-12);
      EXPECT_EQ(tracks[1].objects.col(f), scene.starts[1].objects.col(f));
      continue;
    }
    EXPECT_LT((pose.rotation[21] - seen[f - kHistory].rotation[21]).norm(), 1e-12);
    EXPECT_EQ(pose.translation, seen[f - kHistory].translation);
    EXPECT_EQ(tracks[1].objects.col(f), scene.in_hand(1, f, seen[f - kHistory]));
  }
}

TEST(RunSynthesis, RootsAreGivenOrPredicted) {
  Config given = testing::SmallConfig();
  given.predicts_root = false;
  const Scene scene(given, 2);
  std::vector<Eigen::Matrix3Xd> roots(2, Eigen::Matrix3Xd::Random(3, 15));
  const SynthesisRequest request{.starts = scene.starts, .roots = roots};
  const auto tracks = RunSynthesis(scene.network, request, scene.in_hand, 1);
  EXPECT_LT((tracks[1].roots.rightCols(11) - roots[1].rightCols(11)).norm(), 1e-6);
  const auto without = RunSynthesis(scene.network, {.starts = scene.starts}, scene.in_hand, 1);
  EXPECT_LT((without[1].roots.col(14) - scene.starts[1].roots.col(3)).norm(), 1e-6);
  const Scene predicted(testing::SmallConfig(), 2);
  const auto moved =
      RunSynthesis(predicted.network, {.starts = predicted.starts}, predicted.in_hand, 1);
  EXPECT_GT((moved[1].roots.col(14) - moved[1].roots.col(13)).norm(), 1e-3);
}

TEST(RunSynthesis, RefusesBadRequests) {
  Scene scene(testing::SmallConfig(), 2);
  const auto run = [&](const SynthesisRequest& request) {
    return RunSynthesis(scene.network, request, scene.in_hand, 2);
  };
  EXPECT_NO_THROW(run({.starts = scene.starts}));
  EXPECT_THROW(run({}), Error);
  EXPECT_THROW(run({.starts = scene.starts, .num_frames = 4}), Error);
  const Eigen::MatrixXf short_noise = Eigen::MatrixXf::Zero(3, 2);
  EXPECT_THROW(run({.starts = scene.starts, .noise = &short_noise}), Error);
  const std::vector<Eigen::Matrix3Xd> few(2, Eigen::Matrix3Xd::Zero(3, 14));
  EXPECT_THROW(run({.starts = scene.starts, .roots = few}), Error);
  const ObjectOfFrame lost = [](int, int, const wandr::Pose<double>&) {
    return Eigen::Vector<double, kObjectSize>(Eigen::Vector<double, kObjectSize>::Constant(NAN));
  };
  EXPECT_THROW(RunSynthesis(scene.network, {.starts = scene.starts}, lost, 1), Error);
  const ObjectOfFrame fails = [](int, int,
                                 const wandr::Pose<double>&) -> Eigen::Vector<double, kObjectSize> {
    throw Error("fit", "no contact", "Give another object");
  };
  EXPECT_THROW(RunSynthesis(scene.network, {.starts = scene.starts}, fails, 2), Error);
  scene.starts[1].condition.conservativeResize(12);
  EXPECT_THROW(run({.starts = scene.starts}), Error);
  scene.starts[1] = scene.starts[0];
  scene.starts[1].poses(7, 2) = NAN;
  EXPECT_THROW(run({.starts = scene.starts}), Error);
}

TEST(ObjectColumns, AreSeenAsConfigured) {
  const Eigen::Matrix3d R = ExpSO3({0.4, -0.8, 0.3});
  const Eigen::Vector3d T(1, 2, 3);
  const auto columns = ObjectColumn(R, T, ObjectRotation::kColumns),
             rows = ObjectColumn(R, T, ObjectRotation::kRows);
  EXPECT_EQ(columns.head<3>(), T);
  EXPECT_DOUBLE_EQ(columns[4], R(0, 1));
  EXPECT_DOUBLE_EQ(rows[4], R(1, 0));
  EXPECT_DOUBLE_EQ(rows[8], R(2, 1));
}

}  // namespace
}  // namespace holdfast::imos
