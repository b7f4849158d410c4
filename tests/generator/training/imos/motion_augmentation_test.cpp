// SPDX-License-Identifier: MIT
#include "generator/training/imos/motion_augmentation.h"

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

double LargestOf(const torch::Tensor& x) { return x.abs().max().item<double>(); }

TEST(InOtherStances, IsTheSameInAllKeyFrames) {
  nn::RandomStream random(5);
  const torch::Tensor moved = InOtherStances(Clocks(), 0.05, random);
  const torch::Tensor step = moved.narrow(1, 1, kFrames - 1) - moved.narrow(1, 0, kFrames - 1);
  EXPECT_LT(LargestOf(step - step.narrow(1, 0, 1)), 1e-5);
  EXPECT_LT(LargestOf(step - 1.0), 0.1 + 1e-5);
  EXPECT_GT(LargestOf(step - 1.0), 0.07);
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
