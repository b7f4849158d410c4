// SPDX-License-Identifier: MIT
#include "generator/training/least_squares_critic.h"

#include "generator/training/network_tensors.h"

namespace holdfast {
namespace {

constexpr double kGradientPenalty = 2.0;

}  // namespace

torch::Tensor DoubtOfScores(const torch::Tensor& scores) {
  return 0.25 * (scores - 1.0).square().mean();
}

torch::Tensor BeliefOfScores(const torch::Tensor& scores) { return (scores + 1.0).square().mean(); }

LeastSquaresCritic::LeastSquaresCritic(const nn::AnyWeights& start, double rate)
    : network_(wandr::TensorsOf(start)),
      optimizer_(network_.Parameters(), torch::optim::AdamOptions(rate).betas({0.5, 0.99})) {}

double LeastSquaresCritic::LearnToTell(const torch::Tensor& real, const torch::Tensor& real_scores,
                                       const torch::Tensor& own_scores,
                                       const torch::Tensor& belief) {
  const torch::Tensor slope =
      torch::autograd::grad({real_scores.sum()}, {real}, {}, /*retain_graph=*/true,
                            /*create_graph=*/true)[0];
  const torch::Tensor loss = (real_scores - 1.0).square().mean() + belief +
                             kGradientPenalty * slope.square().sum(1).mean();
  optimizer_.zero_grad();
  loss.backward();
  optimizer_.step();
  return 0.5 * ((real_scores > 0.0).to(torch::kFloat32).mean().item<double>() +
                (own_scores < 0.0).to(torch::kFloat32).mean().item<double>());
}

}  // namespace holdfast
