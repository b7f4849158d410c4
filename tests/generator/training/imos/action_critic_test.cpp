// SPDX-License-Identifier: MIT
#include "generator/training/imos/action_critic.h"

#include <ATen/CPUGeneratorImpl.h>
#include <gtest/gtest.h>

#include "tests/support/action_scene.h"

namespace holdfast::imos {
namespace {

// The first of those key frames for ever: nobody's motion.
std::vector<torch::Tensor> StandingStill(const std::vector<torch::Tensor>& frames) {
  return std::vector<torch::Tensor>(frames.size(), frames.front());
}

class Critic : public ::testing::Test {
 protected:
  double Learn(int steps) {
    double right = 0.0;
    for (int k = 0; k < steps; ++k) right = critic_.Learn(true_, still_, batch_.action, generator_);
    return right;
  }

  SequenceTensors batch_ = TensorsOf(testing::ComposedSequences(24));
  ActionCritic critic_{batch_, 1};
  std::vector<torch::Tensor> frames_ = ActionCritic::TrueFrames(batch_);
  torch::Tensor true_ = critic_.Motions(frames_);
  torch::Tensor still_ = critic_.Motions(StandingStill(frames_));
  at::Generator generator_ = at::detail::createCPUGenerator(2);
};

TEST_F(Critic, SeesNumbersOfOneScale) {
  ASSERT_EQ(true_.size(1), 1725);
  EXPECT_LT(true_.mean(0).abs().max().item<double>(), 1e-3);
  EXPECT_LT(true_.std(0).max().item<double>(), 1.0 + 1e-3);
  // The steps of who stands still are those of nothing: other than the mean.
  EXPECT_GT((still_ - true_).abs().max().item<double>(), 0.5);
}

TEST_F(Critic, BlurMovesPositionsByMetersAndTurnsByTheirLever) {
  const std::vector<torch::Tensor> blurred = ActionCritic::Blurred(frames_, 0.02, generator_);
  ASSERT_EQ(blurred.size(), frames_.size());
  const torch::Tensor noise = torch::stack(blurred) - torch::stack(frames_);  // (12 x B x 75)
  EXPECT_NEAR(noise.narrow(2, 0, 69).std().item<double>(), 0.02, 0.001);
  EXPECT_NEAR(noise.narrow(2, 69, 6).std().item<double>(), 0.2, 0.02);
  EXPECT_NEAR(noise.mean().item<double>(), 0.0, 0.005);
  // Another draw in every key frame: a shift would leave steps as they are.
  EXPECT_NEAR((noise[1] - noise[0]).narrow(1, 0, 69).std().item<double>(), 0.028, 0.003);
}

TEST_F(Critic, WithoutBlurFramesAreAsTheyWere) {
  EXPECT_TRUE(torch::equal(torch::stack(ActionCritic::Blurred(frames_, 0.0, generator_)),
                           torch::stack(frames_)));
}

// A tremor of a millimeter is all that these differ by.
TEST_F(Critic, UnderBlurATremorTellsNothing) {
  const std::vector<torch::Tensor> trembling = ActionCritic::Blurred(frames_, 0.001, generator_);
  double right = 0.0;
  for (int k = 0; k < 60; ++k) {
    const auto seen = [&](const std::vector<torch::Tensor>& frames) {
      return critic_.Motions(ActionCritic::Blurred(frames, 0.02, generator_));
    };
    right = critic_.Learn(seen(frames_), seen(trembling), batch_.action, generator_);
  }
  EXPECT_LT(right, 0.85);
}

TEST_F(Critic, LearnsToTellMotionsAndTheirActions) {
  EXPECT_GT(Learn(150), 0.9);
  const double of_true = critic_.Doubt(true_, batch_.action).item<double>();
  const double of_still = critic_.Doubt(still_, batch_.action).item<double>();
  const torch::Tensor other = batch_.action.roll(1);  // three actions, in turn
  ASSERT_TRUE(other.ne(batch_.action).all().item<bool>());
  const double of_other = critic_.Doubt(true_, other).item<double>();
  EXPECT_LT(of_true, 0.2);
  EXPECT_GT(of_still, 0.5);
  EXPECT_GT(of_other, 0.5);
}

// What networks learn from it.
TEST_F(Critic, GradientOfItsDoubtIsThatOfDifferences) {
  Learn(20);
  critic_.Network().ForEach([](const std::string&, torch::Tensor& tensor) {
    const torch::NoGradGuard no_gradients;
    tensor.set_data(tensor.to(torch::kFloat64));
  });
  torch::Tensor motions = still_.to(torch::kFloat64).clone().requires_grad_(true);
  const torch::Tensor gradient =
      torch::autograd::grad({critic_.Doubt(motions, batch_.action)}, {motions})[0];
  EXPECT_GT(gradient.abs().max().item<double>(), 1e-5);
  const torch::NoGradGuard no_gradients;
  for (const std::int64_t at : {0, 70, 901, 1724}) {
    constexpr double kStep = 1e-5;
    torch::Tensor moved = motions.detach().clone();
    moved[3][at] += kStep;
    const double above = critic_.Doubt(moved, batch_.action).item<double>();
    moved[3][at] -= 2.0 * kStep;
    const double below = critic_.Doubt(moved, batch_.action).item<double>();
    EXPECT_NEAR(gradient[3][at].item<double>(), (above - below) / (2.0 * kStep), 1e-8);
  }
}

}  // namespace
}  // namespace holdfast::imos
