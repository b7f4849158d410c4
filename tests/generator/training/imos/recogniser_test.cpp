// SPDX-License-Identifier: MIT
#include "generator/training/imos/recogniser.h"

#include <limits>

#include <gtest/gtest.h>

#include "generator/imos/synthesis_metrics.h"
#include "geometry/error.h"
#include "tests/support/action_scene.h"

namespace holdfast::imos {
namespace {

// Three actions, each in several styles.
LabelledMotions ComposedMotions(int count, int first = 0) {
  LabelledMotions set;
  for (int k = first; k < first + count; ++k) {
    const ActionSequence sequence = testing::ComposedSequence(k, k);
    set.motions.push_back(sequence.joints);
    set.labels.push_back(sequence.action);
  }
  return set;
}

RecogniserOptions ShortOptions() {
  RecogniserOptions options;
  options.batch = 4;
  options.epochs = 60;
  options.patience = 0;
  return options;
}

// What is trained is what is run.
TEST(TorchRecogniser, ComputesWhatTheRunTimeComputes) {
  const RecogniserWeights weights = RandomRecogniser(3);
  const LabelledMotions set = ComposedMotions(5);
  const Recognition run = Recogniser(weights).Recognise(set.motions);
  const TorchRecogniser network(weights);
  const Recognition trained = network.Recognise(set.motions);
  EXPECT_LT((run.logits - trained.logits).cwiseAbs().maxCoeff(), 1e-6f);
  EXPECT_LT((run.features - trained.features).cwiseAbs().maxCoeff(), 1e-7f);
  EXPECT_EQ(run.labels, trained.labels);
  const RecogniserWeights back = network.Weights();
  ASSERT_EQ(back.tensors.size(), weights.tensors.size());
  for (const auto& [name, tensor] : weights.tensors) {
    EXPECT_EQ(back.tensors.at(name).shape, tensor.shape) << name;
    EXPECT_EQ(back.tensors.at(name).values, tensor.values) << name;
  }
}

TEST(TrainRecogniser, LearnsAFewSequencesByHeartAndKnowsTheirLike) {
  const LabelledMotions training = ComposedMotions(12), others = ComposedMotions(6, 12);
  RecogniserOptions options = ShortOptions();
  options.epochs = 100;
  options.stance_m = options.jitter_m = 0.0;
  const TrainedRecogniser trained = TrainRecogniser(training, {}, options);
  EXPECT_LT(trained.best.training_loss, 0.02);
  EXPECT_GT(trained.epochs.front().training_loss, 0.3);
  const Recogniser recogniser(trained.weights);
  EXPECT_EQ(RecognitionAccuracy(recogniser.Recognise(training.motions).labels, training.labels),
            1.0);
  EXPECT_EQ(RecognitionAccuracy(recogniser.Recognise(others.motions).labels, others.labels), 1.0);
}

TEST(TrainRecogniser, KeepsTheEpochThatValidatesBestAndStopsEarly) {
  // Labels to validate with that nothing can teach: the loss there rises from some epoch on.
  LabelledMotions validation = ComposedMotions(3, 20);
  for (int& label : validation.labels) label = 28;
  RecogniserOptions options = ShortOptions();
  options.patience = 5;
  options.least_steps = 0;
  const TrainedRecogniser trained = TrainRecogniser(ComposedMotions(9), validation, options);
  EXPECT_LT(static_cast<int>(trained.epochs.size()), options.epochs);
  EXPECT_EQ(static_cast<int>(trained.epochs.size()), trained.best.epoch + options.patience);
  for (const RecogniserEpoch& epoch : trained.epochs) {
    EXPECT_TRUE(epoch.validation_accuracy < trained.best.validation_accuracy ||
                epoch.validation_loss >= trained.best.validation_loss);
  }
  const Recognition kept = Recogniser(trained.weights).Recognise(validation.motions);
  double loss = 0.0;
  for (Eigen::Index n = 0; n < kept.logits.cols(); ++n) {
    const Eigen::VectorXd x = kept.logits.col(n).cast<double>();
    loss += (std::log((x.array() - x.maxCoeff()).exp().sum()) + x.maxCoeff() - x[28]) / 3.0;
  }
  EXPECT_NEAR(loss, trained.best.validation_loss, 1e-3) << "weights take motions as they are";
}

TEST(TrainRecogniser, GivesTheSameWeightsAgain) {
  RecogniserOptions options = ShortOptions();
  options.epochs = 3;
  const LabelledMotions set = ComposedMotions(6);
  const RecogniserWeights first = TrainRecogniser(set, {}, options).weights;
  const RecogniserWeights second = TrainRecogniser(set, {}, options).weights;
  options.seed = 2;
  const RecogniserWeights other = TrainRecogniser(set, {}, options).weights;
  for (const auto& [name, tensor] : first.tensors) {
    EXPECT_EQ(tensor.values, second.tensors.at(name).values) << name;
    EXPECT_NE(tensor.values, other.tensors.at(name).values) << name;
  }
}

TEST(TrainRecogniser, IsStoppedByItsCaller) {
  const TrainedRecogniser trained =
      TrainRecogniser(ComposedMotions(3), {}, ShortOptions(),
                      [](const RecogniserEpoch& epoch) { return epoch.epoch < 2; });
  EXPECT_EQ(trained.epochs.size(), 2u);
}

TEST(TrainRecogniser, RefusesWhatItCannotLearnFrom) {
  EXPECT_THROW(TrainRecogniser({}, {}, ShortOptions()), Error);
  LabelledMotions set = ComposedMotions(3);
  set.labels[1] = 29;
  EXPECT_THROW(TrainRecogniser(set, {}, ShortOptions()), Error);
  set = ComposedMotions(3);
  set.labels.pop_back();
  EXPECT_THROW(TrainRecogniser(set, {}, ShortOptions()), Error);
  set = ComposedMotions(3);
  set.motions[2](0, 3) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(TrainRecogniser(set, {}, ShortOptions()), Error);
  set = ComposedMotions(3);
  set.motions[0] = set.motions[0].leftCols(14).eval();
  EXPECT_THROW(TrainRecogniser(set, {}, ShortOptions()), Error);
}

}  // namespace
}  // namespace holdfast::imos
