// SPDX-License-Identifier: MIT
#include "generator/training/imos/recognizer.h"

#include <limits>

#include <gtest/gtest.h>

#include "generator/imos/synthesis_metrics.h"
#include "geometry/error.h"
#include "tests/support/action_scene.h"

namespace holdfast::imos {
namespace {

// Three actions, each in several styles.
LabeledMotions ComposedMotions(int count, int first = 0) {
  LabeledMotions set;
  for (int k = first; k < first + count; ++k) {
    const ActionSequence sequence = testing::ComposedSequence(k, k);
    set.motions.push_back(sequence.joints);
    set.labels.push_back(sequence.action);
  }
  return set;
}

RecognizerOptions ShortOptions() {
  RecognizerOptions options;
  options.batch = 4;
  options.epochs = 60;
  options.patience = 0;
  return options;
}

// What is trained is what is run.
TEST(TorchRecognizer, ComputesWhatTheRunTimeComputes) {
  const RecognizerWeights weights = RandomRecognizer(3);
  const LabeledMotions set = ComposedMotions(5);
  const Recognition run = Recognizer(weights).Recognize(set.motions);
  const TorchRecognizer network(weights);
  const Recognition trained = network.Recognize(set.motions);
  EXPECT_LT((run.logits - trained.logits).cwiseAbs().maxCoeff(), 1e-6f);
  EXPECT_LT((run.features - trained.features).cwiseAbs().maxCoeff(), 1e-7f);
  EXPECT_EQ(run.labels, trained.labels);
  const RecognizerWeights back = network.Weights();
  ASSERT_EQ(back.tensors.size(), weights.tensors.size());
  for (const auto& [name, tensor] : weights.tensors) {
    EXPECT_EQ(back.tensors.at(name).shape, tensor.shape) << name;
    EXPECT_EQ(back.tensors.at(name).values, tensor.values) << name;
  }
}

TEST(TrainRecognizer, LearnsAFewSequencesByHeartAndKnowsTheirLike) {
  const LabeledMotions training = ComposedMotions(12), others = ComposedMotions(6, 12);
  RecognizerOptions options = ShortOptions();
  options.epochs = 100;
  options.stance_m = options.jitter_m = 0.0;
  const TrainedRecognizer trained = TrainRecognizer(training, {}, options);
  EXPECT_LT(trained.best.training_loss, 0.02);
  EXPECT_GT(trained.epochs.front().training_loss, 0.3);
  const Recognizer recognizer(trained.weights);
  EXPECT_EQ(RecognitionAccuracy(recognizer.Recognize(training.motions).labels, training.labels),
            1.0);
  EXPECT_EQ(RecognitionAccuracy(recognizer.Recognize(others.motions).labels, others.labels), 1.0);
}

TEST(TrainRecognizer, KeepsTheEpochThatValidatesBestAndStopsEarly) {
  // Labels to validate with that nothing can teach: the loss there rises from some epoch on.
  LabeledMotions validation = ComposedMotions(3, 20);
  for (int& label : validation.labels) label = 28;
  RecognizerOptions options = ShortOptions();
  options.patience = 5;
  options.least_steps = 0;
  const TrainedRecognizer trained = TrainRecognizer(ComposedMotions(9), validation, options);
  EXPECT_LT(static_cast<int>(trained.epochs.size()), options.epochs);
  EXPECT_EQ(static_cast<int>(trained.epochs.size()), trained.best.epoch + options.patience);
  for (const RecognizerEpoch& epoch : trained.epochs) {
    EXPECT_TRUE(epoch.validation_accuracy < trained.best.validation_accuracy ||
                epoch.validation_loss >= trained.best.validation_loss);
  }
  const Recognition kept = Recognizer(trained.weights).Recognize(validation.motions);
  double loss = 0.0;
  for (Eigen::Index n = 0; n < kept.logits.cols(); ++n) {
    const Eigen::VectorXd x = kept.logits.col(n).cast<double>();
    loss += (std::log((x.array() - x.maxCoeff()).exp().sum()) + x.maxCoeff() - x[28]) / 3.0;
  }
  EXPECT_NEAR(loss, trained.best.validation_loss, 1e-3) << "weights take motions as they are";
}

TEST(TrainRecognizer, GivesTheSameWeightsAgain) {
  RecognizerOptions options = ShortOptions();
  options.epochs = 3;
  const LabeledMotions set = ComposedMotions(6);
  const RecognizerWeights first = TrainRecognizer(set, {}, options).weights;
  const RecognizerWeights second = TrainRecognizer(set, {}, options).weights;
  options.seed = 2;
  const RecognizerWeights other = TrainRecognizer(set, {}, options).weights;
  for (const auto& [name, tensor] : first.tensors) {
    EXPECT_EQ(tensor.values, second.tensors.at(name).values) << name;
    EXPECT_NE(tensor.values, other.tensors.at(name).values) << name;
  }
}

TEST(TrainRecognizer, IsStoppedByItsCaller) {
  const TrainedRecognizer trained =
      TrainRecognizer(ComposedMotions(3), {}, ShortOptions(),
                      [](const RecognizerEpoch& epoch) { return epoch.epoch < 2; });
  EXPECT_EQ(trained.epochs.size(), 2u);
}

TEST(TrainRecognizer, RefusesWhatItCannotLearnFrom) {
  EXPECT_THROW(TrainRecognizer({}, {}, ShortOptions()), Error);
  LabeledMotions set = ComposedMotions(3);
  set.labels[1] = 29;
  EXPECT_THROW(TrainRecognizer(set, {}, ShortOptions()), Error);
  set = ComposedMotions(3);
  set.labels.pop_back();
  EXPECT_THROW(TrainRecognizer(set, {}, ShortOptions()), Error);
  set = ComposedMotions(3);
  set.motions[2](0, 3) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(TrainRecognizer(set, {}, ShortOptions()), Error);
  set = ComposedMotions(3);
  set.motions[0] = set.motions[0].leftCols(14).eval();
  EXPECT_THROW(TrainRecognizer(set, {}, ShortOptions()), Error);
}

}  // namespace
}  // namespace holdfast::imos
