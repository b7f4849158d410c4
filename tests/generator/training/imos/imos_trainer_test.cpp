// SPDX-License-Identifier: MIT
#include "generator/training/imos/imos_trainer.h"

#include <filesystem>

#include <ATen/CPUGeneratorImpl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "generator/imos/rollout.h"
#include "generator/training/imos/imos_trainer_state.h"
#include "geometry/error.h"
#include "tests/support/action_scene.h"
#include "tests/support/temporary_folder.h"

namespace holdfast::imos {
namespace {

using holdfast::testing::TemporaryFolder;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

Config TinyConfig() {
  Config config = CompactConfig();
  config.action_size = 4;
  config.block_width = 24;
  config.arms_condition = 12;
  config.arms_first = 24;
  config.arms_second = 16;
  config.arms_decoder = 24;
  config.arms_latent = 4;
  config.body_condition = 12;
  config.body_first = 24;
  config.body_second = 16;
  config.body_decoder = 24;
  config.body_latent = 4;
  config.attention_layers = 2;
  config.attention_heads = 2;
  config.attention_width = 4;
  return config;
}

TrainingOptions TinyOptions() {
  TrainingOptions options;
  options.config = TinyConfig();
  options.iterations = 20;
  options.batch = 8;
  options.shard = 4;
  return options;
}

TrainingOptions TinyPaperOptions() {
  TrainingOptions options = PaperOptions();
  const Config published = PaperConfig();
  options.config = TinyConfig();
  options.config.arms_see_class = published.arms_see_class;
  options.config.arms_object = published.arms_object;
  options.config.object_now = published.object_now;
  options.config.object_rotation = published.object_rotation;
  options.config.root = published.root;
  options.config.body_makes = published.body_makes;
  options.config.attended_past = published.attended_past;
  options.config.sees_progress = published.sees_progress;
  options.true_history_epochs = 5;
  options.iterations = 20;
  options.batch = 8;
  return options;
}

std::vector<float> AllWeights(const Trainer& trainer) {
  std::vector<float> all;
  for (const auto& [name, tensor] : trainer.Weights(true).tensors) {
    all.insert(all.end(), tensor.values.begin(), tensor.values.end());
  }
  return all;
}

// A rollout of the run-time network by itself: latents' means, the object carried by the wrist.
Eigen::MatrixXf RunTimeRollout(const NetworkWeights& weights, const ActionSequence& sequence) {
  const Network<float> network(weights);
  const Config& config = network.Options();
  Rollout<float> rollout(network, 1, kNumKeyFrames);
  const Eigen::VectorXf condition =
      ConditionOf(sequence.betas, {sequence.action, sequence.object}, ActionTable(weights));
  rollout.Begin(condition);
  const wandr::BoneOffsets<double> bones = wandr::BoneOffsetsOf(sequence.rest_joints);
  wandr::BodyKinematics<double> last, next;
  ObjectPose object;
  for (int t = 0; t < kHistory; ++t) {
    object = {sequence.ObjectRotation(t), sequence.object_transl.col(t)};
    rollout.SetHistory(t, 0, sequence.pose.col(t).head<kPoseSize>().cast<float>(),
                       sequence.transl.col(t).cast<float>(),
                       ObjectColumn(object.R, object.T, config.object_rotation).cast<float>());
    ForwardKinematics(bones, sequence.BodyPose(t), last);
  }
  Eigen::MatrixXf joints = sequence.joints.cast<float>();
  const Eigen::MatrixXf noise = Eigen::MatrixXf::Zero(config.NoiseSize(), 1);
  for (int t = kHistory; t < kNumKeyFrames; ++t) {
    rollout.Step(noise);
    if (config.root == RootTranslation::kGiven) {
      rollout.SetRoot(0, sequence.transl.col(t).cast<float>());
    }
    const KeyFrame<float>& frame = rollout.Frame(t);
    ForwardKinematics(
        bones, PoseOfColumn(frame.pose.col(0).cast<double>(), frame.root.col(0).cast<double>()),
        next);
    object = Carried(object, sequence.carriers[t], last, next);
    rollout.SetObject(0, ObjectColumn(object.R, object.T, config.object_rotation).cast<float>());
    joints.col(t) = Eigen::Map<const Eigen::VectorXd>(next.joints.data(), 66).cast<float>();
    last = next;
  }
  return joints;
}

// What is trained is what is run.
TEST(ImosTrainer, TrainsWhatTheRunTimeComputes) {
  const std::vector<ActionSequence> sequences = testing::ComposedSequences(8);
  std::vector<TrainingOptions> all(5, TinyOptions());
  all[1].config.modules = Modules::kOne;
  all[2].config.self_attention = false;
  all[3].config.body_makes = BodyMakes::kPose;
  all[4] = TinyPaperOptions();
  for (TrainingOptions& options : all) {
    options.iterations = 6;
    Trainer trainer(sequences, options);
    while (trainer.Iteration() < options.iterations) trainer.Step();
    const Eigen::MatrixXf trained = trainer.Rollout(sequences[1], false);
    const Eigen::MatrixXf run = RunTimeRollout(trainer.Weights(false), sequences[1]);
    EXPECT_LT((trained - run).cwiseAbs().maxCoeff(), 1e-3f);
    // Neither stands still, nor tells the truth: it is a motion of the network's own.
    const Eigen::MatrixXf truth = sequences[1].joints.cast<float>();
    EXPECT_GT((run.rightCols(8) - truth.rightCols(8)).cwiseAbs().maxCoeff(), 1e-3f);
  }
}

// Of three steps through time, the object in the predicted hand; in double precision.
TEST(ImosTrainer, GradientsAreThoseOfFiniteDifferences) {
  const std::vector<ActionSequence> sequences = testing::ComposedSequences(5);
  for (const Modules modules : {Modules::kTwo, Modules::kOne}) {
    Config config = TinyConfig();
    config.modules = modules;
    TorchNetworks networks(config, StartingTensors(config, false, 3), "test");
    for (auto& [name, tensor] : networks.Named()) {
      const bool moves = tensor.requires_grad();
      tensor = tensor.detach().to(torch::kFloat64).requires_grad_(moves);
    }
    SequenceTensors batch = TensorsOf(sequences);
    for (torch::Tensor* tensor :
         {&batch.pose, &batch.transl, &batch.joints, &batch.object_T, &batch.object_R,
          &batch.by_left, &batch.by_right, &batch.bones, &batch.betas, &batch.object_id}) {
      *tensor = tensor->to(torch::kFloat64);
    }
    const auto loss = [&] {
      at::Generator generator = at::detail::createCPUGenerator(7);
      Pass pass;
      pass.batch_statistics = true;
      pass.generator = &generator;
      Unroller unroller(networks, batch, 6, 0.01, pass, generator);
      LossWeights weights;
      weights.wrists = 0.5;
      torch::Tensor sum = torch::zeros({}, torch::kFloat64);
      for (int step = 0; step < 3; ++step) {
        StepOptions how;
        how.present_share = modules == Modules::kTwo ? 0.5 : 0.0;
        const TorchFrame frame = unroller.Predict(how);
        const StepLosses losses = unroller.Judge(frame, weights);
        sum = sum + losses.body_total;
        if (losses.arms_total.defined()) sum = sum + losses.arms_total;
        unroller.Advance(frame);
      }
      return sum;
    };
    const std::vector<torch::Tensor> parameters = networks.Parameters();
    const auto gradients = torch::autograd::grad({loss()}, parameters);
    const torch::NoGradGuard no_gradients;
    nn::RandomStream random(5);
    for (std::size_t k = 0; k < parameters.size(); ++k) {
      torch::Tensor flat = parameters[k].view({-1});
      const auto at =
          static_cast<std::int64_t>(random.Uniform() * static_cast<double>(flat.numel()));
      constexpr double kStep = 1e-6;
      const double value = flat[at].item<double>();
      flat[at] = value + kStep;
      const double above = loss().item<double>();
      flat[at] = value - kStep;
      const double below = loss().item<double>();
      flat[at] = value;
      const double expected = (above - below) / (2.0 * kStep);
      EXPECT_NEAR(gradients[k].view({-1})[at].item<double>(), expected,
                  1e-5 + 1e-3 * std::abs(expected))
          << "parameter " << k;
    }
  }
}

TEST(ImosTrainer, LearnsAHandfulOfSequences) {
  const std::vector<ActionSequence> sequences = testing::ComposedSequences(6);
  TrainingOptions options;
  options.config.action_size = 8;
  options.config.block_width = 64;
  options.config.arms_first = options.config.arms_decoder = 96;
  options.config.body_first = options.config.body_decoder = 96;
  options.iterations = 400;
  options.batch = 6;
  options.learning_rate = 3e-3;
  // It is to know them by heart, all of the body alike.
  options.stance_noise_rad = options.shape_noise = 0.0;
  options.losses.wrists = 1.0;
  options.critic = 0.0;
  Trainer trainer(sequences, options);
  while (trainer.Iteration() < options.iterations) trainer.Step();
  const RolloutErrors errors = trainer.Evaluate(sequences);
  EXPECT_GT(errors.still_m, 0.025);
  EXPECT_LT(errors.mpjpe_m, 0.012);
  EXPECT_LT(errors.wrists_m, 0.05);
  EXPECT_LT(errors.object_m, 0.06);
  // It is the intent that tells them apart: another action from the same start goes elsewhere.
  ActionSequence other = sequences[0];
  other.action = sequences[1].action;
  other.object = sequences[1].object;
  const Eigen::Vector3f there = trainer.Rollout(sequences[0], false).col(14).tail<3>();
  const Eigen::Vector3f elsewhere = trainer.Rollout(other, false).col(14).tail<3>();
  EXPECT_GT((there - elsewhere).norm(), 0.15f);
}

TEST(ImosTrainer, AsPublishedItLearnsToo) {
  const std::vector<ActionSequence> sequences = testing::ComposedSequences(8);
  TrainingOptions options = TinyPaperOptions();
  options.iterations = 60;
  options.learning_rate = 3e-3;
  Trainer trainer(sequences, options);
  const Losses first = trainer.Step();
  Losses last;
  while (trainer.Iteration() < options.iterations) last = trainer.Step();
  // The body is given as it is, the arms as a step: those begin near the truth.
  EXPECT_LT(last.body, 0.5 * first.body);
  EXPECT_LT(last.total, 0.5 * first.total);
  EXPECT_LE(trainer.LearningRate(), options.learning_rate);
}

TEST(ImosTrainer, PlateauLowersTheRateAfterPatience) {
  PlateauSchedule schedule;
  schedule.rate = 1.0;
  schedule.Observe(10.0);
  for (int k = 0; k < 3; ++k) schedule.Observe(9.8);  // not 5 % better
  EXPECT_DOUBLE_EQ(schedule.rate, 1.0);
  schedule.Observe(9.8);
  EXPECT_DOUBLE_EQ(schedule.rate, 0.999);
  schedule.Observe(9.0);
  EXPECT_DOUBLE_EQ(schedule.best, 9.0);
  schedule.rate = 2e-7;
  for (int k = 0; k < 8; ++k) schedule.Observe(9.0);
  EXPECT_DOUBLE_EQ(schedule.rate, 2e-7);
}

TEST(ImosTrainer, GoesOnBitForBit) {
  const std::vector<ActionSequence> sequences = testing::ComposedSequences(20);
  const TemporaryFolder folder;
  for (const TrainingOptions& options : {TinyOptions(), TinyPaperOptions()}) {
    Trainer whole(sequences, options);
    while (whole.Iteration() < options.iterations) whole.Step();
    Trainer first(sequences, options);
    while (first.Iteration() < 13) first.Step();
    first.Save(folder / "checkpoint.safetensors");
    Trainer second(sequences, options);
    second.Load(folder / "checkpoint.safetensors");
    EXPECT_EQ(second.Iteration(), 13);
    while (second.Iteration() < options.iterations) second.Step();
    EXPECT_EQ(AllWeights(second), AllWeights(whole));
  }
}

TEST(ImosTrainer, ThreadsDoNotChangeTheWeights) {
  const std::vector<ActionSequence> sequences = testing::ComposedSequences(16);
  TrainingOptions options = TinyOptions();
  options.batch = 16;
  options.dropout = 0.1;
  Trainer one(sequences, options);
  options.threads = 3;
  Trainer three(sequences, options);
  for (int k = 0; k < 12; ++k) {
    one.Step();
    three.Step();
  }
  EXPECT_EQ(AllWeights(one), AllWeights(three));
}

TEST(ImosTrainer, RandomEmbeddingsStayAsTheyAre) {
  const std::vector<ActionSequence> sequences = testing::ComposedSequences(8);
  TrainingOptions options = TinyOptions();
  const auto table = [](const Trainer& trainer) {
    return trainer.Weights(true).tensors.at("action_embedding.weight").values;
  };
  for (const ActionEmbedding kind : {ActionEmbedding::kRandom, ActionEmbedding::kLearned}) {
    options.config.action_embedding = kind;
    Trainer trainer(sequences, options);
    const std::vector<float> before = table(trainer);
    for (int k = 0; k < 3; ++k) trainer.Step();
    EXPECT_EQ(table(trainer) == before, kind == ActionEmbedding::kRandom);
  }
  options.config.action_embedding = ActionEmbedding::kGiven;
  const Eigen::MatrixXf given = Eigen::MatrixXf::Random(kNumActions, options.config.action_size);
  const Trainer trainer(sequences, options, given);
  EXPECT_FLOAT_EQ(ActionTable(trainer.Weights(false))(3, 2), given(3, 2));
}

TEST(ImosTrainer, RefusesWhatMakesNoSense) {
  const std::vector<ActionSequence> sequences = testing::ComposedSequences(8);
  const TemporaryFolder folder;
  EXPECT_THAT([&] { Trainer({}, TinyOptions()); }, ThrowsMessage<Error>(HasSubstr("0 sequence")));
  TrainingOptions options = TinyOptions();
  options.config.arm_order = ArmOrder::kRightThenLeft;
  EXPECT_THAT([&] { Trainer(sequences, options); }, ThrowsMessage<Error>(HasSubstr("ascending")));
  EXPECT_THAT([&] { Trainer(sequences, TinyOptions(), Eigen::MatrixXf::Zero(29, 3)); },
              ThrowsMessage<Error>(HasSubstr("29 x 3")));
  Trainer trainer(sequences, TinyOptions());
  trainer.Step();
  trainer.Save(folder / "checkpoint.safetensors");
  options = TinyOptions();
  options.learning_rate = 2e-3;
  Trainer other(sequences, options);
  EXPECT_THAT([&] { other.Load(folder / "checkpoint.safetensors"); },
              ThrowsMessage<Error>(HasSubstr("other options")));
  WriteNetwork(trainer.Weights(true), folder / "weights.safetensors");
  EXPECT_THAT([&] { trainer.Load(folder / "weights.safetensors"); },
              ThrowsMessage<Error>(HasSubstr("not a checkpoint")));
  std::vector<ActionSequence> odd = sequences;
  odd[2].pose.conservativeResize(kPoseNumbers, 9);
  odd[2].source = "odd.npz";
  EXPECT_THAT([&] { Trainer(odd, TinyOptions()); }, ThrowsMessage<Error>(HasSubstr("odd.npz")));
}

}  // namespace
}  // namespace holdfast::imos
