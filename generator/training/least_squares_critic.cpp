// SPDX-License-Identifier: MIT
#include "generator/training/least_squares_critic.h"

namespace holdfast {
namespace {

constexpr double kGradientPenalty = 2.0;

}  // namespace

torch::Tensor DoubtOfScores(const torch::Tensor& scores) {
  return 0.25 * (scores - 1.0).square().mean();
}

torch::Tensor BeliefOfScores(const torch::Tensor& scores) { return (scores + 1.0).square().mean(); }

double LearnToTell(const torch::Tensor& real, const torch::Tensor& real_scores,
                   const torch::Tensor& own_scores, const torch::Tensor& belief,
                   torch::optim::Adam& optimizer) {
  const torch::Tensor slope =
      torch::autograd::grad({real_scores.sum()}, {real}, {}, /*retain_graph=*/true,
                            /*create_graph=*/true)[0];
  const torch::Tensor loss = (real_scores - 1.0).square().mean() + belief +
                             kGradientPenalty * slope.square().sum(1).mean();
  optimizer.zero_grad();
  loss.backward();
  optimizer.step();
  return 0.5 * ((real_scores > 0.0).to(torch::kFloat32).mean().item<double>() +
                (own_scores < 0.0).to(torch::kFloat32).mean().item<double>());
}

}  // namespace holdfast
