// SPDX-License-Identifier: MIT
#pragma once

#include <torch/torch.h>

#include "generator/nn/network_weights.h"
#include "generator/training/torch_network.h"

namespace holdfast {

/// Mean of (score - 1)^2 / 4: 0 for what is taken for true, 1 for what is not.
torch::Tensor DoubtOfScores(const torch::Tensor& scores);

/// Mean of (score + 1)^2: what a critic has to learn of what is not true.
torch::Tensor BeliefOfScores(const torch::Tensor& scores);

/// What critics have in common that tell true motions from a network's own by least squares (Mao et
/// al. 2017): scores of +1 for true ones and -1 for others.
class LeastSquaresCritic {
 public:
  wandr::TorchNetwork& Network() { return network_; }
  const wandr::TorchNetwork& Network() const { return network_; }
  torch::optim::Adam& Optimizer() { return optimizer_; }
  const torch::optim::Adam& Optimizer() const { return optimizer_; }

 protected:
  /// `rate` is Adam's.
  LeastSquaresCritic(const nn::AnyWeights& start, double rate);
  /// One step: true scores towards +1, `belief` (of what is not true) down, and gradients of true
  /// scores with respect to `real`, which takes them, kept small (Mescheder et al. 2018). Returns
  /// the share of true and own scores whose sign is right.
  double LearnToTell(const torch::Tensor& real, const torch::Tensor& real_scores,
                     const torch::Tensor& own_scores, const torch::Tensor& belief);

 private:
  wandr::TorchNetwork network_;
  torch::optim::Adam optimizer_;
};

}  // namespace holdfast
