// SPDX-License-Identifier: MIT
// Motions and gradients that PyTorch got from small networks of both architectures, by a loop
// written from the paper (tests/fixtures/make_wandr.py).
#include <cstdlib>
#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "generator/wandr/motion_states.h"
#include "geometry/io/container/npz.h"
#include "tests/support/error_text.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/wandr_scene.h"

namespace holdfast::wandr {
namespace {

using testing::RelativeError;

const std::filesystem::path kFixtures = HOLDFAST_SOURCE_DIR "/tests/fixtures/wandr";
constexpr int kBodies = 3, kSteps = 6, kLatent = 4;

// Column i: what belongs to body i.
Eigen::MatrixXd Columns(const NpzReader& file, const char* name, int rows) {
  const std::vector<double> values = file.Read(name).AsDoubles();
  return Eigen::Map<const Eigen::MatrixXd>(values.data(), rows,
                                           static_cast<Eigen::Index>(values.size()) / rows);
}

void Compare(const std::filesystem::path& folder) {
  const NpzReader file(folder / "motions.npz");
  const Network<double> network(ReadNetwork(folder / "network.safetensors"));
  ASSERT_EQ(network.LatentSize(), kLatent);
  ASSERT_EQ(network.Layout(), IntentionLayout::kPaper);
  const BoneOffsets<double> bones = BoneOffsetsOf(Columns(file, "rest_joints", 3));
  const Eigen::MatrixXd states = Columns(file, "states", kStateSize),
                        previous = Columns(file, "previous_deltas", kStateSize),
                        goals = Columns(file, "goals", 3),
                        latents = Columns(file, "latents", kLatent * kSteps),
                        motions = Columns(file, "motions", kStateSize),
                        weights = Columns(file, "weights", 3);
  std::vector<RolloutStart<double>> starts;
  std::vector<GoalPlan> plans;
  for (int i = 0; i < kBodies; ++i) {
    starts.push_back({PoseOf<double>(states.col(i)), previous.col(i)});
    plans.push_back({{goals.col(i), kSteps + 2}});
  }
  Rollout<double> rollout(network, bones, kBodies, kSteps, {}, true);
  rollout.Begin(starts, plans);
  for (int t = 0; t < kSteps; ++t) rollout.Step(latents.middleRows(kLatent * t, kLatent));
  for (int i = 0; i < kBodies; ++i) {
    for (int t = 0; t <= kSteps; ++t) {
      EXPECT_LT(
          (StateOf(rollout.Poses(t)[i]) - motions.col(i * (kSteps + 1) + t)).cwiseAbs().maxCoeff(),
          1e-9)
          << "body " << i << ", frame " << t;
    }
  }
  RolloutSeed<double> seed;
  seed.poses.resize(kSteps + 1);
  seed.poses[kSteps] = Eigen::MatrixXd::Zero(kTangentSize, kBodies);
  seed.poses[kSteps].topRows<3>() = weights;
  RolloutGradient<double> gradient;
  rollout.Backward(seed, 1, gradient);
  const Eigen::MatrixXd d_latents = Columns(file, "d_latents", kLatent * kSteps),
                        d_previous = Columns(file, "d_previous_deltas", kStateSize),
                        d_goals = Columns(file, "d_goals", 3);
  EXPECT_LT(RelativeError(gradient.latents, d_latents), 1e-8);
  EXPECT_LT(RelativeError(gradient.previous_delta, d_previous), 1e-8);
  EXPECT_LT(RelativeError(gradient.goals, d_goals), 1e-8);
}

TEST(PyTorchReference, MotionsAndGradientsAreTheSame) { Compare(kFixtures); }

TEST(PyTorchReference, TheAuthorsFilesHoldTheSameNetwork) {
  const ImportedNetwork imported =
      ImportNetwork(kFixtures / "wandr.ckpt", kFixtures / "statistics.npy");
  EXPECT_EQ(imported.ignored, std::vector<std::string>{"body_model.v_template"});
  holdfast::testing::TemporaryFolder folder;
  WriteNetwork(imported.weights, folder.Path() / "network.safetensors");
  std::filesystem::copy_file(kFixtures / "motions.npz", folder.Path() / "motions.npz");
  Compare(folder.Path());
  EXPECT_THAT(holdfast::testing::ErrorText(
                  [] { ImportNetwork(kFixtures / "statistics.npy", kFixtures / "wandr.ckpt"); }),
              ::testing::HasSubstr("statistics.npy: it has no tensor 'decoder.layers.<i>.weight'"));
  EXPECT_THAT(holdfast::testing::ErrorText(
                  [] { ImportNetwork(kFixtures / "wandr.ckpt", kFixtures / "wandr.ckpt"); }),
              ::testing::HasSubstr("there is no tensor 'statistics.body_"));
}

TEST(PyTorchReference, MotionsAndGradientsOfAResidualNetworkAreTheSame) {
  const NetworkWeights weights = ReadNetwork(kFixtures / "residual" / "network.safetensors");
  ASSERT_TRUE(std::holds_alternative<nn::ResidualWeights>(weights.decoder));
  Compare(kFixtures / "residual");
}

void CompareFresh(const std::string& options) {
  if (std::system("/usr/bin/python3 -c 'import numpy, torch' 2>/dev/null") != 0) {
    GTEST_SKIP() << "python3-torch is not installed";
  }
  if (std::system("/usr/bin/python3 -c 'import sys; sys.path.append(\"" HOLDFAST_SOURCE_DIR
                  "/build/release/python\"); import holdfast' 2>/dev/null") != 0) {
    GTEST_SKIP() << "the Python module is neither in build/release nor on PYTHONPATH";
  }
  const holdfast::testing::TemporaryFolder folder;
  ASSERT_EQ(
      std::system(("/usr/bin/python3 '" HOLDFAST_SOURCE_DIR "/tests/fixtures/make_wandr.py' '" +
                   folder.Path().string() + "' " + options)
                      .c_str()),
      0);
  Compare(folder.Path());
}

TEST(PyTorchReference, WithOtherWeightsToo) { CompareFresh("77"); }

TEST(PyTorchReference, WithOtherWeightsOfAResidualNetworkToo) { CompareFresh("78 residual"); }

}  // namespace
}  // namespace holdfast::wandr
