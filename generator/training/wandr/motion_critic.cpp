// SPDX-License-Identifier: MIT
#include "generator/training/wandr/motion_critic.h"

#include "generator/wandr/statistics.h"

namespace holdfast::wandr {
namespace {

constexpr int kMomentSize = kIntentionOf + kStateSize;
constexpr double kRate = 2e-4;

}  // namespace

MotionCritic::MotionCritic(std::uint64_t seed)
    : LeastSquaresCritic(nn::RandomResidual(kMomentSize, 0, kWidth, kBlocks, 1, seed), kRate) {}

torch::Tensor MotionCritic::Moments(const torch::Tensor& conditions, const torch::Tensor& deltas) {
  return torch::cat({conditions.narrow(1, 0, kIntentionOf), deltas}, 1);
}

torch::Tensor MotionCritic::Doubt(const torch::Tensor& moments) const {
  return DoubtOfScores(Network().Forward(moments));
}

double MotionCritic::Learn(const torch::Tensor& true_moments, const torch::Tensor& own_moments) {
  const torch::Tensor real = true_moments.detach().clone().requires_grad_(true);
  const torch::Tensor real_score = Network().Forward(real);
  const torch::Tensor own_score = Network().Forward(own_moments.detach());
  return LearnToTell(real, real_score, own_score, BeliefOfScores(own_score));
}

}  // namespace holdfast::wandr
