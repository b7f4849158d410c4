// SPDX-License-Identifier: MIT
#pragma once

#include <torch/torch.h>

/// What critics have in common that tell true motions from a network's own by least squares (Mao et
/// al. 2017): scores of +1 for true ones and -1 for others.
namespace holdfast {

/// Mean of (score - 1)^2 / 4: 0 for what is taken for true, 1 for what is not.
torch::Tensor DoubtOfScores(const torch::Tensor& scores);

/// Mean of (score + 1)^2: what a critic has to learn of what is not true.
torch::Tensor BeliefOfScores(const torch::Tensor& scores);

/// One step of a critic's learning: true scores towards +1, `belief` (of what is not true) down,
/// and gradients of true scores with respect to `real`, which takes them, kept small (Mescheder et
/// al. 2018). Returns the share of true and own scores whose sign is right.
double LearnToTell(const torch::Tensor& real, const torch::Tensor& real_scores,
                   const torch::Tensor& own_scores, const torch::Tensor& belief,
                   torch::optim::Adam& optimizer);

}  // namespace holdfast
