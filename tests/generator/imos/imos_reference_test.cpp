// SPDX-License-Identifier: MIT
// Motions that PyTorch got from small networks of several configurations, by a graph
// of the published modules (tests/fixtures/make_imos.py).
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "generator/imos/weights.h"
#include "geometry/io/container/npz.h"
#include "tests/support/imos_scene.h"
#include "tests/support/temporary_folder.h"

namespace holdfast::imos {
namespace {

const std::filesystem::path kFixtures = HOLDFAST_SOURCE_DIR "/tests/fixtures/imos";
constexpr int kSamples = 2, kFrames = 7;

// Column i: what belongs to sample i.
Eigen::MatrixXd Columns(const NpzReader& file, const std::string& name) {
  const std::vector<double> values = file.Read(name).AsDoubles();
  return Eigen::Map<const Eigen::MatrixXd>(
      values.data(), static_cast<Eigen::Index>(values.size()) / kSamples, kSamples);
}

testing::Given<double> ReadGiven(const NpzReader& file, const std::string& name) {
  testing::Given<double> given;
  given.conditions = Columns(file, name + "/conditions");
  given.noise = Columns(file, name + "/noise");
  const Eigen::MatrixXd poses = Columns(file, name + "/poses"),
                        roots = Columns(file, name + "/roots"),
                        objects = Columns(file, name + "/objects");
  for (int f = 0; f < kFrames; ++f) {
    given.objects.push_back(objects.middleRows(kObjectSize * f, kObjectSize));
    if (f >= kHistory) continue;
    given.history.push_back({poses.middleRows(kPoseSize * f, kPoseSize),
                             roots.middleRows(3 * f, 3),
                             given.objects[f],
                             {}});
  }
  return given;
}

struct Fixture {
  std::uint64_t seed;
  std::map<std::string, Config> configs;
};

Fixture ReadFixture(const std::filesystem::path& folder) {
  const nlohmann::json json = nlohmann::json::parse(std::ifstream(folder / "configs.json"));
  Fixture fixture{json.at("seed"), {}};
  for (const auto& [name, texts] : json.at("configs").items()) {
    auto left = texts.get<std::map<std::string, std::string>>();
    fixture.configs[name] = ConfigFromTexts(left, name);
    EXPECT_TRUE(left.empty()) << name;
  }
  return fixture;
}

void CompareMotions(const NpzReader& file, const std::string& name, const NetworkWeights& weights) {
  SCOPED_TRACE(name);
  const int noise_size = weights.config.NoiseSize();
  const testing::Given<double> given = ReadGiven(file, name);
  const Eigen::MatrixXd motions = Columns(file, name + "/motions"),
                        roots = Columns(file, name + "/root_tracks");
  const Network<double> network(weights);
  Rollout<double> rollout(network, kSamples, kFrames);
  testing::Roll(rollout, given, noise_size);
  const Network<float> single(weights);
  Rollout<float> in_single(single, kSamples, kFrames);
  testing::Roll(in_single, given.Cast<float>(), noise_size);
  double largest = 0.0;
  for (int f = kHistory; f < kFrames; ++f) {
    const Eigen::MatrixXd pose = motions.middleRows(kPoseSize * f, kPoseSize);
    const Eigen::MatrixXd root = roots.middleRows(3 * f, 3);
    largest = std::max(largest, pose.cwiseAbs().maxCoeff());
    EXPECT_LT((rollout.Frame(f).pose - pose).cwiseAbs().maxCoeff(), 1e-11) << "frame " << f;
    EXPECT_LT((rollout.Frame(f).root - root).cwiseAbs().maxCoeff(), 1e-11) << "frame " << f;
    EXPECT_LT((in_single.Frame(f).pose.cast<double>() - pose).cwiseAbs().maxCoeff(), 1e-5)
        << "frame " << f;
    EXPECT_LT((in_single.Frame(f).root.cast<double>() - root).cwiseAbs().maxCoeff(), 1e-5)
        << "frame " << f;
  }
  EXPECT_GT(largest, 0.5);  // networks that do nothing would be alike, too
}

void Compare(const std::filesystem::path& folder) {
  const NpzReader file(folder / "motions.npz");
  const Fixture fixture = ReadFixture(folder);
  ASSERT_EQ(fixture.configs.size(), 6u);
  for (const auto& [name, config] : fixture.configs) {
    CompareMotions(file, name, testing::DrawnNetwork(config, fixture.seed));
  }
}

void CompareCheckpoint(const std::filesystem::path& folder) {
  const Fixture fixture = ReadFixture(folder);
  ImportWeightsOptions options;
  options.keep_training = true;
  const ImportedWeights imported = ImportWeights(folder / "arms.p", folder / "body.p", options);
  const Config& config = fixture.configs.at("published");
  EXPECT_EQ(imported.weights.config, config);
  const NetworkWeights expected = testing::DrawnNetwork(config, fixture.seed, true);
  ASSERT_EQ(imported.weights.tensors.size(), expected.tensors.size());
  for (const auto& [name, tensor] : expected.tensors) {
    EXPECT_EQ(imported.weights.tensors.at(name).shape, tensor.shape) << name;
    EXPECT_EQ(imported.weights.tensors.at(name).values, tensor.values) << name;
  }
  CompareMotions(NpzReader(folder / "motions.npz"), "published", imported.weights);
}

TEST(ImosPyTorchReference, MotionsAreTheSame) { Compare(kFixtures); }

TEST(ImosPyTorchReference, AnImportedCheckpointMovesAlike) { CompareCheckpoint(kFixtures); }

TEST(ImosPyTorchReference, WithOtherWeightsToo) {
  if (std::system("/usr/bin/python3 -c 'import numpy, torch' 2>/dev/null") != 0) {
    GTEST_SKIP() << "python3-torch is not installed";
  }
  if (std::system("/usr/bin/python3 -c 'import sys; sys.path.append(\"" HOLDFAST_SOURCE_DIR
                  "/build/release/python\"); import holdfast' 2>/dev/null") != 0) {
    GTEST_SKIP() << "the Python module is neither in build/release nor on PYTHONPATH";
  }
  const holdfast::testing::TemporaryFolder folder;
  ASSERT_EQ(
      std::system(("/usr/bin/python3 '" HOLDFAST_SOURCE_DIR "/tests/fixtures/make_imos.py' '" +
                   folder.Path().string() + "' 77")
                      .c_str()),
      0);
  Compare(folder.Path());
  CompareCheckpoint(folder.Path());
}

}  // namespace
}  // namespace holdfast::imos
