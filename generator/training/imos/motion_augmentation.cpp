// SPDX-License-Identifier: MIT
#include "generator/training/imos/motion_augmentation.h"

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

torch::Tensor Jittered(const torch::Tensor& motions, double jitter_m, nn::RandomStream& random) {
  return motions + Draws(motions.sizes(), jitter_m, random);
}

}  // namespace holdfast::imos
