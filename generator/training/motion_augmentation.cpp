// SPDX-License-Identifier: MIT
#include "generator/training/motion_augmentation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace holdfast::imos {
namespace {

constexpr double kScale = 0.1;

torch::Tensor Draws(at::IntArrayRef shape, double deviation, nn::RandomStream& random) {
  torch::Tensor draws = torch::empty(shape);
  float* const values = draws.data_ptr<float>();
  double pair[2] = {};
  for (std::int64_t i = 0; i < draws.numel(); ++i) {
    if (i % 2 == 0) random.NormalPair(pair[0], pair[1]);
    values[i] = static_cast<float>(deviation * pair[i % 2]);
  }
  return draws;
}

}  // namespace

torch::Tensor InOtherStances(const torch::Tensor& motions, double stance_m,
                             nn::RandomStream& random) {
  const auto count = motions.size(0);
  const torch::Tensor shift = Draws({count, 1, motions.size(2)}, stance_m, random);
  torch::Tensor scale = torch::empty({count, 1, 1});
  for (std::int64_t n = 0; n < count; ++n) {
    scale[n][0][0] = static_cast<float>(1.0 + kScale * (2.0 * random.Uniform() - 1.0));
  }
  return motions * scale + shift;
}

torch::Tensor AtOtherPaces(const torch::Tensor& motions, double pace, nn::RandomStream& random) {
  const auto count = motions.size(0), frames = motions.size(1);
  if (frames < 2) return motions;
  const double last = static_cast<double>(frames - 1);
  torch::Tensor from = torch::empty({count, frames}, torch::kInt64);
  torch::Tensor way = torch::empty({count, frames, 1});
  auto from_at = from.accessor<std::int64_t, 2>();
  auto way_at = way.accessor<float, 3>();
  for (std::int64_t n = 0; n < count; ++n) {
    const double a = 2.0 * random.Uniform() - 1.0, b = random.Uniform() - 0.5;
    for (std::int64_t k = 0; k < frames; ++k) {
      const double turn = std::numbers::pi * static_cast<double>(k) / last;
      const double at = std::clamp(
          static_cast<double>(k) + pace * (a * std::sin(turn) + b * std::sin(2.0 * turn)), 0.0,
          last);
      from_at[n][k] = std::min(static_cast<std::int64_t>(at), frames - 2);
      way_at[n][k][0] = static_cast<float>(at - static_cast<double>(from_at[n][k]));
    }
  }
  const auto taken = [&](const torch::Tensor& index) {
    return motions.gather(1, index.unsqueeze(2).expand({-1, -1, motions.size(2)}));
  };
  return (1.0 - way) * taken(from) + way * taken(from + 1);
}

torch::Tensor Jittered(const torch::Tensor& motions, double jitter_m, nn::RandomStream& random) {
  return motions + Draws(motions.sizes(), jitter_m, random);
}

}  // namespace holdfast::imos
