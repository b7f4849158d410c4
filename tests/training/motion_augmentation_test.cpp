// SPDX-License-Identifier: MIT
#include "generator/training/motion_augmentation.h"

#include <gtest/gtest.h>

namespace holdfast::imos {
namespace {

constexpr std::int64_t kCount = 40, kFrames = 15, kNumbers = 66;

// Every number of key frame k is k, so that a motion says when it was.
torch::Tensor Clocks() {
  return torch::arange(kFrames)
      .to(torch::kFloat32)
      .view({1, -1, 1})
      .expand({kCount, kFrames, kNumbers});
}

double Largest(const torch::Tensor& x) { return x.abs().max().item<double>(); }

TEST(AtOtherPaces, MovesKeyFramesInTimeButTheEnds) {
  nn::RandomStream random(3);
  const torch::Tensor when = AtOtherPaces(Clocks(), 1.0, random), shift = when - Clocks();
  EXPECT_LT(Largest(shift.select(1, 0)), 1e-6);
  EXPECT_LT(Largest(shift.select(1, kFrames - 1)), 1e-5);
  EXPECT_LT(Largest(shift), 1.5);
  EXPECT_GT(Largest(shift), 0.7);
  EXPECT_LT(Largest(when - when.narrow(2, 0, 1)), 1e-5) << "all joints alike";
  EXPECT_GT(Largest(when - when.narrow(0, 0, 1)), 0.5) << "each motion at its own pace";
  EXPECT_GT((when.narrow(1, 1, kFrames - 1) - when.narrow(1, 0, kFrames - 1)).min().item<float>(),
            0.3f)
      << "time goes on";
}

TEST(AtOtherPaces, LeavesWhatHasNoTime) {
  nn::RandomStream random(3);
  const torch::Tensor one = torch::rand({4, 1, kNumbers});
  EXPECT_EQ(Largest(AtOtherPaces(one, 1.0, random) - one), 0.0);
  EXPECT_EQ(Largest(AtOtherPaces(Clocks(), 0.0, random) - Clocks()), 0.0);
}

TEST(InOtherStances, IsTheSameInAllKeyFrames) {
  nn::RandomStream random(5);
  const torch::Tensor moved = InOtherStances(Clocks(), 0.05, random);
  const torch::Tensor step = moved.narrow(1, 1, kFrames - 1) - moved.narrow(1, 0, kFrames - 1);
  EXPECT_LT(Largest(step - step.narrow(1, 0, 1)), 1e-5);
  EXPECT_LT(Largest(step - 1.0), 0.1 + 1e-5);
  EXPECT_GT(Largest(step - 1.0), 0.07);
  EXPECT_NEAR(moved.select(1, 0).std().item<double>(), 0.05, 0.005);
}

TEST(Jittered, AddsDrawsOfItsDeviation) {
  nn::RandomStream random(7);
  const torch::Tensor jitter = Jittered(Clocks(), 0.015, random) - Clocks();
  EXPECT_NEAR(jitter.std().item<double>(), 0.015, 3e-4);
  EXPECT_NEAR(jitter.mean().item<double>(), 0.0, 4e-4);
}

}  // namespace
}  // namespace holdfast::imos
