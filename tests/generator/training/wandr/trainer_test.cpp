// SPDX-License-Identifier: MIT
#include "generator/training/wandr/trainer.h"

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "generator/nn/column_network.h"
#include "generator/training/torch_network.h"
#include "geometry/error.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/training_scene.h"

namespace holdfast::wandr {
namespace {

using ::testing::HasSubstr;

TrainingOptions SmallOptions() {
  TrainingOptions options;
  options.width = 32;
  options.blocks = 2;
  options.latent_size = 8;
  options.iterations = 40;
  options.frames_per_iteration = 128;
  options.longest_unroll = 8;
  options.free_from = 0.5;
  options.free_bodies = 4;
  options.standing = {0.08f, 0.02f};
  options.deadline = DeadlineRule::Fixed(20);
  return options;
}

std::vector<float> AllWeights(const Trainer& trainer) {
  nn::TensorMap tensors;
  const NetworkWeights weights = trainer.Weights(true);
  nn::AddTensors(weights.decoder, "decoder", tensors);
  nn::AddTensors(*weights.encoder, "encoder", tensors);
  std::vector<float> all;
  for (const auto& [name, tensor] : tensors) {
    all.insert(all.end(), tensor.values.begin(), tensor.values.end());
  }
  return all;
}

nn::TensorMap Plain(const nn::AnyWeights& weights) {
  nn::TensorMap prefixed, plain;
  nn::AddTensors(weights, "net", prefixed);
  for (auto& [name, tensor] : prefixed) plain[name.substr(4)] = tensor;
  return plain;
}

// What is trained is what is run.
TEST(TorchNetwork, ComputesWhatTheRunTimeComputes) {
  for (const NetworkWeights& weights :
       {testing::SmallNetwork(IntentionLayout::kBounded, 3),
        testing::SmallResidualNetwork(IntentionLayout::kBounded, 3)}) {
    const auto network = nn::MakeNetwork<float>(weights.decoder);
    const TorchNetwork torch_network(Plain(weights.decoder));
    constexpr int kColumns = 5;
    nn::Tape<float> tape(*network, kColumns);
    const torch::Tensor x = torch::randn({kColumns, network->InputSize()});
    tape.Input() = Eigen::Map<const Eigen::MatrixXf>(x.data_ptr<float>(), x.size(1), x.size(0));
    network->Forward(tape);
    const torch::Tensor y = torch_network.Forward(x).detach().contiguous();
    const Eigen::Map<const Eigen::MatrixXf> expected(y.data_ptr<float>(), y.size(1), y.size(0));
    EXPECT_LT((tape.Output() - expected).cwiseAbs().maxCoeff(), 2e-5f);
  }
}

TEST(Trainer, LearnsWhatItIsShown) {
  const Corpus corpus = testing::ComposedCorpus();
  TrainingOptions options = SmallOptions();
  options.iterations = 300;
  options.free_from = 1.0;
  options.goals.perturbed = 0.0;
  Trainer trainer(corpus, testing::DefaultBones().Cast<float>(), options);
  const double before = trainer.Validate(corpus).pose;
  while (trainer.Iteration() < options.iterations) trainer.Step();
  EXPECT_LT(trainer.Validate(corpus).pose, 0.6 * before);
}

TEST(Trainer, WhatItSavesGoesOnExactly) {
  const holdfast::testing::TemporaryFolder folder;
  const Corpus corpus = testing::ComposedCorpus();
  const auto bones = testing::DefaultBones().Cast<float>();
  Trainer through(corpus, bones, SmallOptions()), first(corpus, bones, SmallOptions());
  // Beyond the point where free motions begin: their reference must survive too.
  for (int k = 0; k < 24; ++k) first.Step();
  first.Save(folder / "checkpoint.safetensors");
  Trainer second(corpus, bones, SmallOptions());
  second.Load(folder / "checkpoint.safetensors");
  EXPECT_EQ(second.Iteration(), 24);
  for (int k = 0; k < 8; ++k) second.Step();
  for (int k = 0; k < 32; ++k) through.Step();
  EXPECT_EQ(AllWeights(second), AllWeights(through));
}

TEST(Trainer, ThreadsChangeNothing) {
  const Corpus corpus = testing::ComposedCorpus();
  const auto bones = testing::DefaultBones().Cast<float>();
  TrainingOptions options = SmallOptions();
  std::vector<float> weights[2];
  for (const int threads : {1, 2}) {
    options.threads = threads;
    Trainer trainer(corpus, bones, options);
    for (int k = 0; k < 25; ++k) trainer.Step();
    weights[threads - 1] = AllWeights(trainer);
  }
  EXPECT_EQ(weights[0], weights[1]);
}

TEST(Trainer, PublishedNetworkTrainsToo) {
  const Corpus corpus = testing::ComposedCorpus();
  TrainingOptions options = PaperOptions();
  options.iterations = 6;
  options.frames_per_iteration = 64;
  options.free_from = 1.0;
  Trainer trainer(corpus, testing::DefaultBones().Cast<float>(), options);
  EXPECT_EQ(trainer.NumParameters(), 4153833);
  const double before = trainer.Step().total;
  for (int k = 0; k < 5; ++k) trainer.Step();
  EXPECT_TRUE(std::isfinite(before));
  EXPECT_EQ(trainer.Weights(true).layout, IntentionLayout::kPaper);
}

TEST(Trainer, RefusesCheckpointsOfOthers) {
  const holdfast::testing::TemporaryFolder folder;
  const Corpus corpus = testing::ComposedCorpus();
  const auto bones = testing::DefaultBones().Cast<float>();
  Trainer trainer(corpus, bones, SmallOptions());
  trainer.Step();
  trainer.Save(folder / "checkpoint.safetensors");
  TrainingOptions wider = SmallOptions();
  wider.width = 40;
  Trainer other(corpus, bones, wider);
  const auto message = [&](const std::filesystem::path& path) -> std::string {
    try {
      other.Load(path);
    } catch (const Error& error) {
      return error.what();
    }
    return "nothing";
  };
  EXPECT_THAT(message(folder / "checkpoint.safetensors"), HasSubstr("other options"));
  WriteNetwork(trainer.Weights(true), folder / "weights.safetensors");
  EXPECT_THAT(message(folder / "weights.safetensors"), HasSubstr("not a checkpoint"));
  EXPECT_THAT(message(folder / "missing.safetensors"), HasSubstr("missing.safetensors"));
}

TEST(Trainer, BeginsWithWeightsGiven) {
  const Corpus corpus = testing::ComposedCorpus();
  const auto bones = testing::DefaultBones().Cast<float>();
  const NetworkWeights given = testing::SmallResidualNetwork(IntentionLayout::kBounded, 4);
  const Trainer trainer(corpus, bones, SmallOptions(), &given);
  const NetworkWeights kept = trainer.Weights(true);
  EXPECT_EQ(Plain(kept.decoder).at("input.weight").values,
            Plain(given.decoder).at("input.weight").values);
  NetworkWeights without = given;
  without.encoder.reset();
  EXPECT_THROW(Trainer(corpus, bones, SmallOptions(), &without), Error);
}

}  // namespace
}  // namespace holdfast::wandr
