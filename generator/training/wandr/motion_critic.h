// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include <torch/torch.h>

#include "generator/training/least_squares_critic.h"

namespace holdfast::wandr {

/// Tells moments of captured and synthetic motion from moments of the network's own (Peng et al.
/// 2021, adversarial motion priors, with derivatives in place of rewards): least squares, +1 for
/// true and -1 for its own, and a penalty on gradients at true ones (Mescheder et al. 2018).
///
/// A moment is what a condition says but the intention, and the delta that follows: the pose, how
/// it was come to, how it goes on (403 numbers, normalized). Feet that slide, bodies that lean and
/// steps that are none show in it.
class MotionCritic : public LeastSquaresCritic {
 public:
  static constexpr int kWidth = 128, kBlocks = 2;

  explicit MotionCritic(std::uint64_t seed);

  /// (N x 403) of conditions (N x 277 or more) and deltas (N x 135).
  static torch::Tensor Moments(const torch::Tensor& conditions, const torch::Tensor& deltas);

  /// Mean over rows of (score - 1)^2 / 4: 0 for what is taken for true, 1 for what is not.
  torch::Tensor Doubt(const torch::Tensor& moments) const;

  /// One step of its own learning; returns the share it judges rightly.
  double Learn(const torch::Tensor& true_moments, const torch::Tensor& own_moments);
};

}  // namespace holdfast::wandr
